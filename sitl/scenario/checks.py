"""What must come out of a scenario: measures of a flight, each with bounds, and whether they hold. Pure.

A check looks at the windows, or at a part of them (`from_s` to `to_s` of window time). A bound is one number, or one
for each sample of link delay from 1 on; the last holds for any longer delay.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitl.constants import AXES, DT_US
from sitl.errors import ScenarioError
from sitl.log import OFF_WINDOW, ON_WINDOW, STATES, Arrays
from sitl.scenario.tables import Table

Numbers = NDArray[np.float64]
Bounds = tuple[float, ...] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One [[check]] of a scenario file. Without an axis, a measure that has axes is checked on each."""

    measure: str
    axes: tuple[str, ...]
    at_least: Bounds
    at_most: Bounds
    from_s: float
    to_s: float
    state: str = ""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What one check found; `value` is None where there is nothing to measure, and then it has failed."""

    name: str
    value: float | None
    at_least: float | None
    at_most: float | None

    @property
    def passed(self) -> bool:
        """The value lies within its bounds."""
        if self.value is None:
            return False
        low = -inf if self.at_least is None else self.at_least
        high = inf if self.at_most is None else self.at_most
        return low <= self.value <= high

    def as_json(self) -> dict[str, Any]:
        """An entry of `checks` in result.json."""
        return {
            "check": self.name,
            "value": self.value,
            "at_least": self.at_least,
            "at_most": self.at_most,
            "passed": self.passed,
        }


@dataclass(frozen=True, slots=True)
class Cut:
    """The part of a flight's windows that a check looks at."""

    off: dict[str, Numbers]
    on: dict[str, Numbers]

    @classmethod
    def of(cls, arrays: Arrays, from_s: float, to_s: float) -> "Cut":
        """Cut both windows, which are equally long, between two times of window time."""
        first, last = round(from_s * 1e6 / DT_US), None if to_s == inf else round(to_s * 1e6 / DT_US)
        window = arrays["window"]
        rows = (np.flatnonzero(window == number)[first:last] for number in (OFF_WINDOW, ON_WINDOW))
        return cls(*({name: array[row].astype(float) for name, array in arrays.items()} for row in rows))


def rms(x: Numbers) -> float:
    """√mean x², mean removed."""
    return float(np.std(x))


def peak(x: Numbers) -> float:
    """max abs(x), mean removed."""
    return float(np.abs(x - x.mean()).max())


def _ratio(over: float, under: float) -> float | None:
    return over / under if under > 0.0 else None


def _command_leak(cut: Cut, axis: int) -> float | None:
    """RMS of the correction over RMS of what the controller itself asks: without disturbance, the share it fights."""
    correction = cut.on["correction"][:, axis]
    own = cut.on["u_e"][:, axis] - correction
    return _ratio(sqrt(float(np.mean(correction**2))), sqrt(float(np.mean(own**2))))


_ERROR = "attitude_error"


def _rate_error(part: dict[str, Numbers], axis: int) -> Numbers:
    """r − y: the rate that the rate loop is asked for less the true one, rad/s (the paper's Fig. 16b)."""
    return part["rate_setpoint"][:, axis] - part["rate"][:, axis]


PER_AXIS: dict[str, Callable[[Cut, int], float | None]] = {
    "rms_ratio": lambda cut, i: _ratio(rms(cut.off[_ERROR][:, i]), rms(cut.on[_ERROR][:, i])),
    "peak_ratio": lambda cut, i: _ratio(peak(cut.off[_ERROR][:, i]), peak(cut.on[_ERROR][:, i])),
    "rms_off": lambda cut, i: rms(cut.off[_ERROR][:, i]),
    "rms_on": lambda cut, i: rms(cut.on[_ERROR][:, i]),
    "peak_off": lambda cut, i: peak(cut.off[_ERROR][:, i]),
    "peak_on": lambda cut, i: peak(cut.on[_ERROR][:, i]),
    "rate_ratio": lambda cut, i: _ratio(rms(_rate_error(cut.off, i)), rms(_rate_error(cut.on, i))),
    "correction": lambda cut, i: float(np.abs(cut.on["correction"][:, i]).max()),
    "command_leak": _command_leak,
}
"""Measures with axes: attitude errors in rad, mean removed; `rate_ratio` is that of the rate's tracking error;
`correction` is the largest in the window on, normalized torque."""

OVERALL: dict[str, Callable[[Cut], float | None]] = {
    "largest_error": lambda cut: float(max(np.abs(part[_ERROR]).max() for part in (cut.off, cut.on))),
    "drift_m": lambda cut: float(max(np.hypot(*part["position"][:, :2].T).max() for part in (cut.off, cut.on))),
    "sink_m": lambda cut: float(np.ptp(cut.on["position"][:, 2])),
    "delay_samples": lambda cut: float(np.median(cut.on["age"])),
    "lost": lambda cut: float(1.0 - cut.on["answered"].mean()),
    "injecting": lambda cut: float(np.any(cut.on["correction"] != 0.0, axis=1).mean()),
}
"""Measures of the whole vehicle: the largest error (rad, mean not removed) and the largest distance from the take-off
point seen from above in both windows; the range of altitude, the median age, the share of samples never answered and
the share with a correction in the window on."""

MEASURES = (*PER_AXIS, *OVERALL, "state")


def _state_share(cut: Cut, state: str) -> float | None:
    """Share of the window on, where the companion told its state, in which it was this one."""
    told = cut.on["state"][cut.on["state"] >= 0]
    return float(np.mean(told == STATES.index(state))) if len(told) else None


def read_checks(tables: list[Table], length_s: float) -> tuple[Check, ...]:
    """The [[check]] tables of a scenario file. Raises ScenarioError."""
    checks = []
    for table in tables:
        measure = table.choice("measure", MEASURES)
        axes: tuple[str, ...] = ()
        if measure in PER_AXIS:
            axes = (table.choice("axis", AXES),) if table.has("axis") else AXES
        state = table.choice("state", STATES) if measure == "state" else ""
        low, high = table.numbers("at_least"), table.numbers("at_most")
        if low is None and high is None:
            raise ScenarioError(f"{table.where('at_least')}: expected at_least, at_most or both")
        from_s = table.number("from_s", 0.0, length_s - 0.1, 0.0)
        to_s = table.number("to_s", from_s + 0.1, length_s) if table.has("to_s") else inf
        checks.append(
            Check(measure=measure, axes=axes, at_least=low, at_most=high, from_s=from_s, to_s=to_s, state=state)
        )
        table.finish()
    return tuple(checks)


def judge(checks: tuple[Check, ...], arrays: Arrays, delay_samples: int) -> list[Verdict]:
    """Every check of a flight with both windows; `delay_samples` is the link's, which picks the bounds."""
    return [verdict for check in checks for verdict in _judge(check, arrays, delay_samples)]


def _judge(check: Check, arrays: Arrays, delay_samples: int) -> list[Verdict]:
    cut = Cut.of(arrays, check.from_s, check.to_s)
    bounds = _bound(check.at_least, delay_samples), _bound(check.at_most, delay_samples)
    when = "" if (check.from_s, check.to_s) == (0.0, inf) else f" {_span(check.from_s, check.to_s)}"
    if check.axes:
        measure = PER_AXIS[check.measure]
        return [Verdict(f"{check.measure} {a}{when}", measure(cut, AXES.index(a)), *bounds) for a in check.axes]
    if check.measure == "state":
        return [Verdict(f"state {check.state}{when}", _state_share(cut, check.state), *bounds)]
    return [Verdict(f"{check.measure}{when}", OVERALL[check.measure](cut), *bounds)]


def _span(from_s: float, to_s: float) -> str:
    return f"from {from_s:g} s" if to_s == inf else f"{from_s:g}–{to_s:g} s"


def _bound(bounds: Bounds, delay_samples: int) -> float | None:
    return None if bounds is None else bounds[min(delay_samples, len(bounds)) - 1]


def lines(verdicts: list[Verdict]) -> list[str]:
    """The verdicts as a table for people."""
    rows = [("check", "value", "at least", "at most", "")]
    for v in verdicts:
        word = "ok" if v.passed else "FAILED"
        rows.append((v.name, _number(v.value), _number(v.at_least), _number(v.at_most), word))
    widths = [max(len(row[i]) for row in rows) for i in range(4)]
    return [
        f"{name:{widths[0]}}  {value:>{widths[1]}}  {low:>{widths[2]}}  {high:>{widths[3]}}  {word}".rstrip()
        for name, value, low, high, word in rows
    ]


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"
