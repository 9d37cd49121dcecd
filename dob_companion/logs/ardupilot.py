"""What an ArduPilot log says of a flight, by the names that its versions have given it."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dob_companion.autopilots.ardupilot import QUADPLANE
from dob_companion.errors import LogError
from dob_companion.files import read_bytes
from dob_companion.identification.record import Floats, Record
from dob_companion.logs import mixer
from dob_companion.logs.ardupilot_units import rate_scale, torque_scale
from dob_companion.logs.choose import Source, chosen
from dob_companion.logs.columns import Table
from dob_companion.logs.dataflash import BinaryLog, DataFlash, TextLog, pieces
from dob_companion.logs.found import Found, Setting, of_each, records
from dob_companion.logs.series import Series, both, joined
from dob_companion.mavlink.makes import ARDUPILOT

_GYRO = ("GyrX", "GyrY", "GyrZ")
_RATES = (("R", "P", "Y"), ("Rll", "Pit", "Yaw"))
_DESIRED = (("RDes", "PDes", "YDes"), ("RllDes", "PitDes", "YawDes"))
_OUT = (("ROut", "POut", "YOut"), ("RllOut", "PitOut", "YawOut"))
_PIDS = ("PIDR", "PIDP", "PIDY")

_LOOP = ("RATE", "SIDD", "SIDS", "IMU", "GYR", "IMT", *_PIDS)
NAMES = frozenset({*_LOOP, "ATT", "ANG", "CTUN", "QTUN", "RCOU", "EV", "ARM", "MODE", "PARM", "MSG"})
"""Messages that are read."""

_REMEDY = (
    "set LOG_BITMASK with bit 0 (fast attitude, which brings RATE at the rate of the loop) and LOG_FILE_RATEMAX 0, "
    "or fly System ID mode with SID_AXIS 10 to 12"
)

_VEHICLES = {
    "ArduCopter": "multicopter", "APM:Copter": "multicopter", "ArduPlane": "plane", "APM:Plane": "plane",
    "ArduRover": "rover", "APM:Rover": "rover", "Rover": "rover", "ArduSub": "submarine", "Blimp": "airship",
    "AntennaTracker": "antenna tracker",
}  # fmt: skip
_CLASSES = {
    1: "quadrotor", 2: "hexarotor", 3: "octorotor", 4: "octorotor", 5: "hexarotor", 6: "helicopter", 7: "tricopter",
    8: "coaxial", 9: "coaxial", 10: "tailsitter copter", 11: "helicopter", 12: "dodecarotor", 13: "helicopter",
    14: "decarotor",
}  # fmt: skip

_MIX_ROLL = 10
"""SID_AXIS of the mixer's roll; pitch and yaw come next."""

_HOVER_MODES = range(17, 24)
"""Of ArduPlane: QSTABILIZE, QHOVER, QLOITER, QLAND, QRTL, QAUTOTUNE, QACRO. In AUTO and GUIDED it may do either."""
_LIFTS = 0.05
"""Least throttle of a quadplane's lifting rotors in the air."""

_EV_ARMED, _EV_DISARMED, _EV_LANDED, _EV_NOT_LANDED = 10, 11, 18, 28
_LIMITED = 1
"""Bit of PIDx.Flags: the mixer was at its limit."""


def read_bin(path: Path) -> tuple[Record, ...]:
    """A binary log, or several in one file. Raises LogError, one line."""
    return of_each(pieces(read_bytes(path)), lambda data: _records(BinaryLog(data), str(path)), str(path))


def read_text(path: Path) -> tuple[Record, ...]:
    """A log as text. Raises LogError, one line."""
    return _records(TextLog(read_bytes(path), NAMES), str(path))


def _records(log: DataFlash, source: str) -> tuple[Record, ...]:
    said = list(log.remarks)
    settings = _settings(log)
    parameters = {name: value for _, name, value in settings}
    vehicle = _vehicle(log, parameters)
    imu = _first_imu(log)
    rates, moments, others = _of_the_loop(log, imu, said)
    rates += _of_the_gyro(log, imu)
    if not moments:
        moments = _of_the_motors(log, parameters, said)
    lacking = [what for what, there in (("body rates", rates), ("moment", moments)) if not there]
    if lacking:
        raise LogError(f"{source}: no RATE in it, and so no {' and no '.join(lacking)}: {_REMEDY}")
    taken, moment, words = chosen(rates, moments, link=True)
    return records(
        Found(
            source=source,
            make=ARDUPILOT,
            vehicle=vehicle,
            rates=taken.series,
            moment=moment.series,
            others=others | _of_the_attitude(log) | _injected(log, parameters, moment.series, said),
            facts=_facts(log) | (_hovering(log, said) if vehicle.startswith("vtol") else {}),
            settings=settings,
            witnesses=_stamps_of_settings(log),
            rates_filtered=taken.filtered,
            remarks=(words, *said),
        )
    )


def _time(table: Table) -> Floats:
    """s since the autopilot's start."""
    if "SampleUS" in table.names:
        sampled = table.column("SampleUS")
        if (sampled > 0).all():
            return 1e-6 * sampled
    if "TimeUS" in table.names:
        return 1e-6 * table.column("TimeUS")
    name = next((name for name in ("TimeMS", "T") if name in table.names), None)
    return 1e-3 * table.column(name) if name else np.full(len(table.place), np.nan)


def _table(log: DataFlash, name: str, columns: Sequence[str]) -> Table | None:
    """The messages of this name, where they have these columns."""
    table = log.table(name)
    return table if table is not None and table.has(columns) else None


def _named(log: DataFlash, name: str, choices: Sequence[Sequence[str]]) -> tuple[Table, Sequence[str]] | None:
    """The messages of this name, and which of the choices of columns they have."""
    table = log.table(name)
    columns = next((names for names in choices if table is not None and table.has(names)), None)
    return (table, columns) if table is not None and columns is not None else None


def _instance(table: Table) -> Table:
    """The first of several sensors: the one with the lowest number."""
    if "I" not in table.names:
        return table
    number = table.column("I")
    return table.where(number == number.min())


def _settings(log: DataFlash) -> list[Setting]:
    table = _table(log, "PARM", ("Name", "Value"))
    if table is None:
        return []
    return list(zip(table.place.tolist(), table.texts("Name"), table.column("Value").tolist(), strict=True))


def _stamps_of_settings(log: DataFlash) -> tuple[Series, ...]:
    table = log.table("PARM")
    return () if table is None else (table.series(_time(table), ()),)


def _first_imu(log: DataFlash) -> Series | None:
    """What every version logs in rad/s: after the gyro filter."""
    table = _table(log, "IMU", _GYRO)
    if table is None:
        return None
    table = _instance(table)
    return table.series(_time(table), _GYRO)


def _of_the_loop(
    log: DataFlash, imu: Series | None, said: list[str]
) -> tuple[list[Source], list[Source], dict[str, Series]]:
    """RATE: rates, moment, and the setpoint of the rates."""
    rates, out, desired = (_named(log, "RATE", choices) for choices in (_RATES, _OUT, _DESIRED))
    if rates is None or out is None:
        return [], [], {}
    table, time = rates[0], _time(rates[0])
    moment = table.series(time, out[1])
    by, words = torque_scale(moment.values)
    said += words
    raw = table.series(time, rates[1])
    scale, words = rate_scale(raw, table.units.get(rates[1][0], ""), imu, counts=by != 1.0)
    said += words
    setpoint = {} if desired is None else {"rate_setpoint": table.series(time, desired[1], scale)}
    filtered = Series(raw.place, raw.time, scale * raw.values)
    moment = Series(moment.place, moment.time, by * moment.values)
    return [Source("RATE", filtered, True)], [Source("RATE", moment)], setpoint


def _of_the_gyro(log: DataFlash, imu: Series | None) -> list[Source]:
    """SIDD, GYR and IMT are before the gyro filter, IMU is after it."""
    found = []
    if (sidd := _table(log, "SIDD", ("Gx", "Gy", "Gz"))) is not None:
        found.append(Source("SIDD", sidd.series(_time(sidd), ("Gx", "Gy", "Gz"), math.pi / 180.0), False))
    if (gyr := _table(log, "GYR", _GYRO)) is not None:
        first = _instance(gyr)
        found.append(Source("GYR", first.series(_time(first), _GYRO), False))
    turned = ("DelAX", "DelAY", "DelAZ")
    if (imt := _table(log, "IMT", (*turned, "DelaT"))) is not None:
        first = _instance(imt)
        with np.errstate(divide="ignore", invalid="ignore"):
            rate = first.series(_time(first), turned).values / first.column("DelaT")[:, None]
        found.append(Source("IMT", Series(first.place, _time(first), rate), False))
    if imu is not None:
        found.append(Source("IMU", imu, True))
    return found


def _of_the_motors(log: DataFlash, parameters: dict[str, float], said: list[str]) -> list[Source]:
    """RCOU through the frame's allocation."""
    factors = mixer.ardupilot_factors(parameters)
    outputs = None if factors is None else mixer.ardupilot_outputs(parameters, len(factors))
    if factors is None or outputs is None:
        return []
    columns = [f"C{output}" for output in outputs]
    found = _named(log, "RCOU", [columns, [f"Ch{output}" for output in outputs]])
    if found is None:
        return []
    table, names = found
    pulses = table.series(_time(table), names)
    frame = f"FRAME_CLASS {parameters['FRAME_CLASS']:g}, FRAME_TYPE {parameters['FRAME_TYPE']:g}"
    said.append(f"no torque is logged: moment unmixed from RCOU by {frame}, what the mixer cut off is missing in it")
    moment = mixer.unmixed(mixer.ardupilot_thrust(pulses.values, parameters), factors)
    return [Source("RCOU", Series(pulses.place, pulses.time, moment))]


def _of_the_attitude(log: DataFlash) -> dict[str, Series]:
    found = {}
    for name in ("ATT", "ANG"):  # ANG is the faster one, where it is logged
        table = _table(log, name, ("Roll", "Pitch", "Yaw", "DesRoll", "DesPitch", "DesYaw"))
        if table is not None:
            time = _time(table)
            found["attitude"] = table.series(time, ("Roll", "Pitch", "Yaw"), math.pi / 180.0)
            found["attitude_setpoint"] = table.series(time, ("DesRoll", "DesPitch", "DesYaw"), math.pi / 180.0)
    throttle = _named(log, "CTUN", (("ThO",), ("ThrOut",)))
    if throttle is not None:
        table, names = throttle
        out = table.series(_time(table), names)
        full = 1000.0 if np.nanmax(out.values, initial=0.0) > 2.0 else 1.0
        found["thrust"] = Series(out.place, out.time, out.values / full)
    return found


def _injected(log: DataFlash, parameters: dict[str, float], moment: Series, said: list[str]) -> dict[str, Series]:
    """What System ID mode adds in front of the mixer; zero while it does not."""
    sidd = _table(log, "SIDD", ("Targ",))
    if sidd is None:
        return {}
    axis = _sid_axis(log, sidd, parameters)
    mixed = (axis >= _MIX_ROLL) & (axis < _MIX_ROLL + 3)
    if not mixed.all():
        others = ", ".join(sorted({f"{number:g}" for number in axis[~mixed]}))
        said.append(
            f"System ID mode moved SID_AXIS {others}, which is not the mixer (10 to 12): not an injected moment"
        )
    if not mixed.any():
        return {}
    added = np.zeros((len(sidd.place), 3))
    added[mixed, (axis[mixed] - _MIX_ROLL).astype(int)] = sidd.column("Targ")[mixed]
    excited = Series(sidd.place, _time(sidd), added)
    return {"injected": joined([excited, _zeros_outside(excited, moment)])}


def _sid_axis(log: DataFlash, sidd: Table, parameters: dict[str, float]) -> Floats:
    """SID_AXIS of each sample: SIDS tells it whenever the mode begins."""
    sids = _table(log, "SIDS", ("Ax",))
    if sids is None:
        return np.full(len(sidd.place), parameters.get("SID_AXIS", 0.0))
    begun = np.searchsorted(sids.place, sidd.place, side="right") - 1
    return np.asarray(sids.column("Ax")[np.maximum(begun, 0)])


def _zeros_outside(excited: Series, moment: Series) -> Series:
    """Before, after and between excitations nothing is added: zeros at the times of the moment."""
    steps = np.sort(excited.time)
    near = np.searchsorted(steps, moment.time)
    gap = np.minimum(
        np.abs(moment.time - steps[np.minimum(near, len(steps) - 1)]),
        np.abs(moment.time - steps[np.maximum(near - 1, 0)]),
    )
    away = gap > 4.0 / max(excited.rate_hz, 1.0)
    return Series(moment.place[away], moment.time[away], np.zeros((int(away.sum()), 3)))


def _vehicle(log: DataFlash, parameters: dict[str, float]) -> str:
    """By what the firmware calls itself, a multicopter by its frame."""
    messages = _table(log, "MSG", ("Message",))
    for text in messages.texts("Message") if messages is not None else ():
        name = next((word for word in _VEHICLES if text.startswith(word)), None)
        if name is not None:
            vehicle = _VEHICLES[name]
            if vehicle == "plane" and parameters.get(QUADPLANE, 0.0) > 0.0:
                return "vtol plane"
            return _CLASSES.get(round(parameters.get("FRAME_CLASS", 0.0)), vehicle) if "opter" in name else vehicle
    return ""


def _facts(log: DataFlash) -> dict[str, Series]:
    found = {}
    events = _table(log, "EV", ("Id",))
    if events is not None:
        number, time = events.column("Id"), _time(events)
        for name, yes, no in (("armed", _EV_ARMED, _EV_DISARMED), ("flying", _EV_NOT_LANDED, _EV_LANDED)):
            told = (number == yes) | (number == no)
            found[name] = Series.of(events.place[told], time[told], number[told] == yes)
    arming = _table(log, "ARM", ("ArmState",))
    if arming is not None:
        found["armed"] = arming.series(_time(arming), ("ArmState",))
    limits = [_table(log, name, ("Flags",)) for name in _PIDS]
    axes = [table for table in limits if table is not None]
    if len(axes) == len(_PIDS) and len({len(table.place) for table in axes}) == 1:
        flags = np.array([table.column("Flags") for table in axes]).astype(int)
        found["saturated"] = Series.of(axes[0].place, _time(axes[0]), ((flags & _LIMITED) > 0).any(axis=0))
    return {name: series for name, series in found.items() if len(series.place)}


def _hovering(log: DataFlash, said: list[str]) -> dict[str, Series]:
    """When a quadplane hangs on its rotors: by its flight mode and their throttle."""
    modes = _named(log, "MODE", (("ModeNum",), ("Mode",)))
    if modes is None:
        said.append("no MODE in it: what it flew as a plane cannot be told from hover")
        return {}
    number = modes[0].series(_time(modes[0]), modes[1])
    hover = Series(number.place, number.time, np.isin(number.values, _HOVER_MODES).astype(np.float64))
    if not hover.values.all():
        names = "QSTABILIZE, QHOVER, QLOITER, QLAND, QRTL, QAUTOTUNE, QACRO"
        said.append(f"of its flight modes {names} count as hover, all others as not flying, which is about hover")
    lifting = _table(log, "QTUN", ("ThO",))
    if lifting is None:
        return {"flying": hover}
    out = lifting.series(_time(lifting), ("ThO",))
    return {"flying": both(hover, Series(out.place, out.time, (out.values > _LIFTS).astype(np.float64)))}
