"""From records to a model of each axis, or to the reason why there is none.

What holds for all axes is judged here: whether a record is fit, was flown, and is of one aircraft with the others. What
is found of each is in `axis`.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from dob_companion.artifact import AXES
from dob_companion.identification import verdict
from dob_companion.identification.axis import OneAxis
from dob_companion.identification.flights import contradiction, joined, known_together
from dob_companion.identification.record import Record
from dob_companion.identification.result import AxisResult, Identification
from dob_companion.identification.segments import USED, segments
from dob_companion.identification.views import Stretches, Views

MOST_MODES = 3


def identify(
    flown: Record | Sequence[Record], *, axes: Sequence[str] = AXES, rate_hz: float = 250.0, modes: int = MOST_MODES
) -> Identification:
    """All of `axes`, for a design at `rate_hz`; `modes`: flexible modes at most on each axis.

    Several records are flights of one aircraft, the newest last: their spectra are averaged, and its parameters hold.
    Never raises for what they hold: an axis of which nothing can be said has the reason in `why`.
    """
    records = (flown,) if isinstance(flown, Record) else tuple(flown)
    remarks = [line for record in records for line in _of(records, record, record.remarks)]
    whole = Identification(
        axes={},
        rate_hz=rate_hz,
        source=", ".join(record.source for record in records),
        segments=(),
        remarks=tuple(remarks),
        parameters=records[-1].parameters,
    )
    if why := _first(records, lambda record: verdict.unfit(record, rate_hz)) or contradiction(records):
        return replace(whole, axes=_refused(axes, why))
    flights = joined(records, rate_hz)
    grid, state = flights.grid, flights.state
    for record, part, begin in zip(records, flights.grids, flights.begins_s, strict=True):
        said = [part.gyro_timing.said("gyro"), part.moment_timing.said("moment")]
        if len(records) > 1:
            said.append(f"from {begin:.1f} s on below")
        if record.armed is None:
            said.append("the record does not tell whether it is armed: taken as armed")
        if record.flying is None and record.thrust is None:
            said.append("the record does not tell whether it flies: taken as flying")
        remarks += _of(records, record, said)
    if grid.rate_hz != rate_hz:
        remarks.append(f"identified at the record's own {grid.rate_hz:g} Hz")
    first = (0, *flights.ends)
    states_of = {id(record): state[first[k] : first[k + 1]] for k, record in enumerate(records)}
    why = _first(records, lambda record: verdict.not_flown(states_of[id(record)], grid))
    if why:
        found = segments(grid, state, {})
        return replace(whole, axes=_refused(axes, why), segments=found, remarks=tuple(dict.fromkeys(remarks)))
    results: dict[str, AxisResult] = {}
    used: dict[str, Stretches] = {}
    views = Views(grid)
    sources = [record.source for record in records]
    for axis in axes:
        said_of, why = known_together(records, axis)
        remarks += [f"{axis}: {line}" for line in said_of.remarks]
        if why:
            results[axis], used[axis] = AxisResult(axis=axis, usable=False, why=why), ()
            continue
        one = OneAxis(views, flights, sources, state == USED, axis, said_of, modes)
        results[axis], used[axis] = one.result()
    return replace(whole, axes=results, segments=segments(grid, state, used), remarks=tuple(dict.fromkeys(remarks)))


def _of(records: Sequence[Record], record: Record, lines: Iterable[str]) -> list[str]:
    """What is said of one of several records names it."""
    return [line if len(records) == 1 else f"{record.source}: {line}" for line in lines]


def _first(records: Sequence[Record], doubt: Callable[[Record], str]) -> str:
    """The first doubt about any of them."""
    return next((said for record in records for said in _of(records, record, filter(None, [doubt(record)]))), "")


def _refused(axes: Sequence[str], why: str) -> dict[str, AxisResult]:
    return {axis: AxisResult(axis=axis, usable=False, why=why) for axis in axes}
