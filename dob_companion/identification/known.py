"""What the autopilot's parameters say beforehand: the filters between the aircraft and the record, those of the link,
and the controller that a direct estimate would show.
"""

from dataclasses import dataclass

from dob_companion.autopilots import Autopilot, Parameters, RateLoop, autopilot_of, recognized
from dob_companion.autopilots.transfer import NOTHING, Transfer, butterworth, constant
from dob_companion.errors import InputError
from dob_companion.identification.record import Record
from dob_companion.mavlink import makes

FILTER_OF_ARDUPILOT = "INS_GYRO_FILTER"


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """Of one axis.

    in_record, in_link   the gyro filter as a factor of what the record shows, and of what the link shows
    about                those of the link, in words
    late_s               how much later the link's rate is than the record's, besides filters
    controllers          C(s) of u = -C y, y as the record shows it: the rate loop alone, and with attitude around it
    doubt                why the record cannot be converted to what the link shows; "" where it can
    """

    in_record: Transfer = NOTHING
    in_link: Transfer = NOTHING
    about: tuple[str, ...] = ()
    late_s: float = 0.0
    controllers: tuple[Transfer, ...] = ()
    doubt: str = ""
    remarks: tuple[str, ...] = ()


def known(record: Record, axis: str) -> Known:
    """By the record's parameters, as far as they go."""
    parameters = Parameters(record.source, record.parameters)
    try:
        autopilot: Autopilot | None = recognized(parameters)
    except InputError:
        autopilot = autopilot_of(record.make, record.vehicle)
    if autopilot is None:
        return Known()
    try:
        loop = autopilot.loop(parameters, axis)
    except InputError as error:
        return _without_gains(record, str(error))
    attitude = parameters.get(autopilot.attitude_gain) if axis != "yaw" else 0.0
    around = loop.controller * (constant(1.0) + Transfer((attitude,), (1.0, 0.0)))
    px4 = record.make == makes.PX4 or autopilot.name == "PX4"
    return _converted(record, loop, (loop.controller, around) if attitude else (loop.controller,), px4)


def _converted(record: Record, loop: RateLoop, controllers: tuple[Transfer, ...], px4: bool) -> Known:
    there = loop.gyro != NOTHING
    if record.rates_filtered is None and there:
        return Known(doubt=f"the record does not tell whether its rates have passed {'; '.join(loop.about_gyro)}")
    in_record = loop.gyro if record.rates_filtered else NOTHING
    # C is of the streamed rate: PX4's, unfiltered, or ArduPilot's, filtered. The record's may be the other.
    if px4 and record.rates_filtered:
        controllers = tuple(each * _inverse(loop.gyro) for each in controllers)
    if not px4 and not record.rates_filtered:
        controllers = tuple(each * loop.gyro for each in controllers)
    remarks: tuple[str, ...] = loop.remarks
    if there and in_record != loop.filters:
        way = "multiplied in" if loop.filters != NOTHING else "taken out"
        remarks += (f"the gyro filter is {way}, as the link shows the rate: {'; '.join(loop.about_gyro)}",)
    return Known(
        in_record=in_record,
        in_link=loop.filters,
        about=loop.about_filters,
        late_s=loop.late_s if px4 and record.rates_filtered else 0.0,
        controllers=controllers,
        remarks=remarks,
    )


def _without_gains(record: Record, why: str) -> Known:
    """The gyro filter may be known when the gains are not."""
    if record.make != makes.ARDUPILOT:
        doubt = "the gyro filter cannot be taken out" if record.rates_filtered else ""
        return Known(doubt=f"{doubt}: {why}" if doubt else "", remarks=(why,))
    if FILTER_OF_ARDUPILOT not in record.parameters:
        if record.rates_filtered is False:
            return Known(doubt=f"parameter {FILTER_OF_ARDUPILOT} is missing: rates on the link have passed it")
        return Known(remarks=(f"{why}; the gyro filter is unknown and therefore part of lag and delay",))
    if record.rates_filtered is None:
        return Known(doubt=f"the record does not tell whether its rates have passed {FILTER_OF_ARDUPILOT}")
    hz = record.parameters[FILTER_OF_ARDUPILOT]
    filters = butterworth(hz)
    about = (f"{FILTER_OF_ARDUPILOT} = {hz:g} Hz, second order",)
    return Known(in_record=filters if record.rates_filtered else NOTHING, in_link=filters, about=about, remarks=(why,))


def _inverse(transfer: Transfer) -> Transfer:
    return Transfer(transfer.den, transfer.num)
