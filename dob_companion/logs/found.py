"""What a reader found in a file, and the records that this makes."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dob_companion.errors import LogError
from dob_companion.identification.record import Facts, Record, Signal
from dob_companion.logs.series import Series, signal, spans

_FEWEST = 16
"""Samples of rates and of moments below which a stretch is no record."""

_MOST = {"rates": (100.0, "rad/s"), "moment": (10.0, "normalized torque")}
"""No gyro shows more and no mixer is asked for more; a file that holds more than a few of these is in other units."""
_FEW = 0.01

SIGNALS = ("injected", "rate_setpoint", "attitude_setpoint", "attitude", "thrust")
FACTS = ("armed", "flying", "saturated")

Setting = tuple[int, str, float]
"""Place in the file, name and value of a parameter."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """A whole file, before it is cut and cleaned; fields as in Record.

    others     the signals of SIGNALS that there are
    facts      those of FACTS, one channel, 0 or 1; time NaN where a fact bears none: it holds from where it stands
    settings   parameters in the file's order
    witnesses  other messages whose stamps tell where a clock began anew
    """

    source: str
    rates: Series
    moment: Series
    make: str = ""
    vehicle: str = ""
    others: Mapping[str, Series] = field(default_factory=dict)
    facts: Mapping[str, Series] = field(default_factory=dict)
    settings: Iterable[Setting] = ()
    witnesses: tuple[Series, ...] = ()
    rates_filtered: bool | None = None
    remarks: tuple[str, ...] = ()


def records(found: Found) -> tuple[Record, ...]:
    """A record for each stretch in which one clock holds. Raises LogError, one line, when there is none."""
    (rates, odd), (moment, odder) = _credible(found, "rates"), _credible(found, "moment")
    found = replace(found, rates=rates, moment=moment, remarks=found.remarks + odd + odder)
    witnesses = [found.moment, *found.others.values(), *found.facts.values(), *found.witnesses]
    cuts, made = spans(found.rates, witnesses), []
    for number, (begin, end) in enumerate(cuts, start=1):
        record = _record(found, begin, end)
        if min(len(record.rates.time), len(record.moment.time)) >= _FEWEST:
            part = (f"part {number} of {len(cuts)}: the clock begins anew",) if len(cuts) > 1 else ()
            made.append(replace(record, remarks=part + record.remarks))
    if not made:
        raise LogError(
            f"{found.source}: holds {_whole(found.rates)} samples of body rates and {_whole(found.moment)} of "
            f"moments, expected {_FEWEST} of each on one clock"
        )
    short = len(cuts) - len(made)
    lost = (f"{short} of {len(cuts)} parts hold too few samples of rates and moments: left out",) if short else ()
    return tuple(replace(record, remarks=record.remarks + lost) for record in made)


def _whole(series: Series) -> str:
    """How many there are, and how many of them are not whole."""
    lost = len(series.time) - int((np.isfinite(series.time) & np.isfinite(series.values).all(axis=1)).sum())
    return f"{len(series.time)} ({lost} not finite)" if lost else f"{len(series.time)}"


def _credible(found: Found, name: str) -> tuple[Series, tuple[str, ...]]:
    """The signal without values that cannot be, and what to say of them. Raises LogError where they are many."""
    series: Series = getattr(found, name)
    most, unit = _MOST[name]
    wrong: NDArray[np.bool_] = np.isfinite(series.values) & (np.abs(series.values) > most)
    beyond = np.asarray(wrong.any(axis=1))
    count = int(beyond.sum())
    if count > max(_FEW * len(series.place), 3):
        typical = float(np.median(np.abs(series.values[beyond]).max(axis=1)))
        raise LogError(f"{found.source}: {name} of {typical:.3g}, expected {unit} of {most:g} at most: other units?")
    said = (f"{name}: {count} of more than {most:g} {unit}, which cannot be: dropped",) if count else ()
    return series.where(~beyond), said


def of_each(logs: Iterable[bytes], read: Callable[[bytes], tuple[Record, ...]], source: str) -> tuple[Record, ...]:
    """The records of all logs in one file. Raises LogError, one line, when none of them holds any."""
    made: list[Record] = []
    refused: list[str] = []
    several = list(logs)
    for number, log in enumerate(several, start=1):
        which = f"log {number} of {len(several)} in the file"
        try:
            found = read(log)
        except LogError as problem:
            words = str(problem).removeprefix(f"{source}: ")
            refused.append(f"{which}: {words}" if len(several) > 1 else words)
        else:
            made += [replace(r, remarks=(which, *r.remarks)) for r in found] if len(several) > 1 else found
    if not made:
        raise LogError(f"{source}: {'; '.join(refused)}")
    left_out = tuple(f"left out: {words}" for words in refused)
    return tuple(replace(record, remarks=record.remarks + left_out) for record in made)


def _record(found: Found, begin: int, end: int) -> Record:
    said: list[str] = []
    rates = _cleaned(found.rates, begin, end, "rates", said)
    moment = _cleaned(found.moment, begin, end, "moment", said)
    starts = [s.time[0] for s in (rates, moment) if len(s.time)]
    start = float(min(starts)) if starts else 0.0
    others = {name: _cleaned(series, begin, end, name, said) for name, series in found.others.items()}
    clock = found.rates.within(begin, end)
    facts = {name: _facts(series.within(begin, end), clock, start) for name, series in found.facts.items()}
    parameters, changed = _parameters(found.settings, begin, end)
    if changed:
        said.append(f"parameters changed on the way, the last value is taken: {', '.join(changed)}")
    record = Record(
        source=found.source,
        make=found.make,
        vehicle=found.vehicle,
        rates=_since(rates, start),
        moment=_since(moment, start),
        parameters=parameters,
        rates_filtered=found.rates_filtered,
        remarks=(*found.remarks, *said),
    )
    there: dict[str, Any] = {name: _since(series, start) for name, series in others.items() if len(series.time)}
    there |= {name: fact for name, fact in facts.items() if len(fact.time)}
    return replace(record, **there)


def _cleaned(series: Series, begin: int, end: int, name: str, said: list[str]) -> Signal:
    """A signal of one stretch; adds to `said` what signals from the same messages have not said yet."""
    cleaned, words = signal(series.within(begin, end))
    told = {line.partition(": ")[2] for line in said}
    said += [f"{name.replace('_', ' ')}: {word}" for word in words if word not in told]
    return cleaned


def _since(cleaned: Signal, start: float) -> Signal:
    return Signal(cleaned.time - start, cleaned.values)


def _facts(series: Series, clock: Series, start: float) -> Facts:
    """In order of time; of several at one time the last one said holds. What is said before the begin may be old."""
    unstamped = np.isnan(series.time)
    if len(clock.place):
        time = np.where(unstamped, np.interp(series.place, clock.place, clock.time), series.time)
        series = replace(series, time=time)
    series = series.where(np.isfinite(series.time) & np.isfinite(series.values[:, 0]))
    order = np.argsort(series.time, kind="stable")
    time, holds = series.time[order] - start, series.values[order, 0] > 0.5
    last = np.concatenate((np.diff(time) > 0.0, [True])) if len(time) else np.zeros(0, dtype=np.bool_)
    return Facts(time[last], holds[last])


_COUNTERS = ("STAT_", "DOB_STATE", "SIM_", "BARO", "MIS_", "MOT_THST_HOVER", "LND_FLIGHT_T", "COM_FLIGHT")
"""Parameters that an autopilot writes itself, or that are of the simulated world."""
_MOST_NAMED = 6


def _parameters(settings: Iterable[Setting], begin: int, end: int) -> tuple[dict[str, float], list[str]]:
    """Those known in a stretch, and the names of those that got another value in it."""
    values: dict[str, float] = {}
    changed: dict[str, None] = {}
    for place, name, value in settings:
        if place >= end:
            break
        if place >= begin and values.get(name, value) != value and not name.startswith(_COUNTERS):
            changed[name] = None
        values[name] = value
    names = list(changed)
    return values, names[:_MOST_NAMED] + ["…"] * (len(names) > _MOST_NAMED)
