"""docs/scenario-results.md from the flights."""

from pathlib import Path

from sitl.constants import AXES
from sitl.scenario.spec import load
from tests.scenarios.wire import Flown

PAGE = Path(__file__).parents[2] / "docs" / "scenario-results.md"

STILL_RAD = 1e-4
"""An axis that moves less than this with the observer off has nothing to compare."""

HEAD = """# Scenario results

Printed by `python -m tests.scenarios --write`: every packaged scenario at one, two and three samples of link delay,
each flown by the real daemon and the simulated vehicle as two processes over UDP, in lockstep, with the observer tuned
for that delay (`examples/tailsitter_tuned.toml`, `_2`, `_3`). What a scenario does and expects stands in
`sitl/scenarios/NAME.toml`, what the measures mean in [scenarios](scenarios.md). [Optimum](optimum.md) sets `paper`
and `paper_nonlinear` beside flights without delay and what is LQG-optimal. Seed {seed}.
{passed} of {all} checks hold.

## Attitude error, observer off over on
RMS / peak over the whole window, faults and faded corrections included; in brackets the paper's peak ratio where it has
one. An axis on which nothing disturbs says nothing: in `aggressive` the error is the pilot's own manoeuvre and must not
change; in `gust` nothing turns roll, and 99 % of the power of its 0.1 mrad is the lag behind position hold's lean.
Where all three are 1 otherwise, the companion has let go for good: `flexible.toml` says why.

In wind, position hold feeds the rate of its lean forward: without that the lag behind the lean, which no observer can
touch, was nine tenths of the power of the pitch error, and the ratios 0.8. In `dryden` 0.27 of pitch's 2.8 mrad lie
above 5 Hz, out of the observer's reach too: with it they are 0.26, 0.32 and 0.37 of the 0.32, 0.38 and 0.44 left.
"""


def page(flights: list[Flown], seed: int) -> str:
    """The whole page."""
    checks = [check for flown in flights for check in flown.checks]
    lines = [HEAD.format(seed=seed, passed=sum(c["passed"] for c in checks), all=len(checks))]
    lines += [
        "| scenario | airframe | delay | roll | pitch | yaw | checks |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    lines += [_row(flown) for flown in flights]
    lines += ["", "## Every check", "| scenario | delay | check | value | at least | at most | |"]
    lines += ["| --- | --- | --- | --- | --- | --- | --- |"]
    lines += [_check(flown, check) for flown in flights for check in flown.checks]
    return "\n".join([*lines, ""])


def _row(flown: Flown) -> str:
    held = sum(check["passed"] for check in flown.checks)
    verdict = f"{held} of {len(flown.checks)}" if flown.result else f"none: {flown.last_words}"
    cells = [_ratio(flown, axis) for axis in AXES]
    return f"| {flown.scenario} | {load(flown.scenario).airframe} | {flown.delay} | {' | '.join(cells)} | {verdict} |"


def _ratio(flown: Flown, axis: str) -> str:
    if flown.result is None:
        return "–"
    numbers = flown.result["axes"][axis]
    if numbers["rms_ratio"] is None or numbers["rms_off"] < STILL_RAD:
        return "–"
    paper = "" if numbers["paper_ratio"] is None else f" ({numbers['paper_ratio']:g})"
    return f"{numbers['rms_ratio']:.2f} / {numbers['peak_ratio']:.2f}{paper}"


def _check(flown: Flown, check: dict) -> str:
    cells = [_number(check[key]) for key in ("value", "at_least", "at_most")]
    verdict = "ok" if check["passed"] else "**failed**"
    return f"| {flown.scenario} | {flown.delay} | {check['check']} | {' | '.join(cells)} | {verdict} |"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"
