"""What the flights of a rehearsal say: usable or not, and why. Pure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from dob_companion.artifact import AXES, DobDesign
from dob_companion.rehearsal.members import Member

SCHEMA = "dob-companion/rehearsal/1"

LEAST_RATIO = 1.0
"""RMS attitude error off / on that every member must reach in every axis that the design has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """One member's flight. `result` is its result.json, None when it did not reach its end; `steady` says whether the
    companion told nothing but ACTIVE in the window on; `said` is what it or the vehicle gave as reason."""

    member: Member
    result: Mapping[str, Any] | None
    steady: bool
    said: str = ""

    @property
    def ratios(self) -> dict[str, float | None]:
        """RMS attitude error off / on of each axis that the design has; None where there is none."""
        axes = self.result["axes"] if self.result else {}
        return {axis: axes[axis]["rms_ratio"] if axis in axes else None for axis in AXES if axis in self.member.changed}

    @property
    def why(self) -> str:
        """Why it is not usable; "" when nothing speaks against it."""
        if self.result is None:
            return self.said or "the flight did not reach its end"
        if not self.steady:
            return f"the observer did not stay on: {self.said or 'no reason was told'}"
        worse = [f"{a} {r:.2f}" for a, r in self.ratios.items() if r is not None and r < LEAST_RATIO]
        return f"off/on below {LEAST_RATIO:g}: {', '.join(worse)}" if worse else ""

    @property
    def least(self) -> float:
        """The least ratio of any axis; 0 of a flight that failed."""
        known = [ratio for ratio in self.ratios.values() if ratio is not None]
        return min(known) if known and self.result is not None and self.steady else 0.0


def weakest(outcomes: Sequence[Outcome]) -> Outcome:
    """The member that brought least."""
    return min(outcomes, key=lambda outcome: outcome.least)


def failed(outcomes: Sequence[Outcome]) -> str:
    """One line on the members that failed; "" when none has."""
    wrong = [f"{o.member.name}: {o.why}" for o in outcomes if o.why]
    return f"{len(wrong)} of {len(outcomes)} aircraft failed: {'; '.join(wrong)}" if wrong else ""


def rehearsal_object(design: DobDesign, outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The content of rehearsal.json."""
    return {
        "schema": SCHEMA,
        "design_sha256": design.sha256,
        "usable": not failed(outcomes),
        "why": failed(outcomes),
        "weakest": weakest(outcomes).member.name,
        "members": [_member(outcome) for outcome in outcomes],
    }


def _member(outcome: Outcome) -> dict[str, Any]:
    axes = outcome.result["axes"] if outcome.result else {}
    kept = ("peak_off", "peak_on", "rms_off", "rms_on", "peak_ratio", "rms_ratio")
    return {
        "name": outcome.member.name,
        "changed": dict(outcome.member.changed),
        "passed": not outcome.why,
        "why": outcome.why,
        "axes": {axis: {key: axes[axis][key] for key in kept} if axis in axes else None for axis in outcome.ratios},
    }


def rehearsal_table(outcomes: Sequence[Outcome]) -> str:
    """Member, off/on of each axis, verdict."""
    axes = tuple(outcomes[0].ratios)
    wide = max(len("aircraft"), *(len(o.member.name) for o in outcomes))
    head = f"{'aircraft':{wide}}" + "".join(f"{axis:>9}" for axis in axes) + "   RMS attitude error, off/on"
    rows = [
        f"{o.member.name:{wide}}"
        + "".join(f"{'–' if r is None else f'{r:.2f}':>9}" for r in o.ratios.values())
        + ("   ok" if not o.why else f"   FAILED: {o.why}")
        for o in outcomes
    ]
    return "\n".join([head, *rows])
