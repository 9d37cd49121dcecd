"""docs/optimum.md from what `optimum.find` found."""

from pathlib import Path
from statistics import median

from dob_companion.comparison.shortfall import NO_LINK, Shortfall, Step
from sitl.constants import AXES
from sitl.scenario.spec import load
from tests.scenarios.optimum import DELAYS, SCENARIOS, SEEDS, Case, Found

PAGE = Path(__file__).parents[2] / "docs" / "optimum.md"

HEAD = """# The paper's disturbance, beside what is LQG-optimal

Printed by `python -m tests.scenarios.optimum --write`: `paper` (linear axes) and `paper_nonlinear` (the tail-sitter),
{seeds} seeds, three axes at once, 30 s off and 30 s on. Delay 0 exists in process only; from 1 on a flight in process
gives the numbers of the same flight over the wire to the last bit (`tests/sitl/campaign/test_wire.py`), of which
[scenario results](scenario-results.md) has one seed. Paper: the weights of `examples/tailsitter_paper.toml`, solved for
the delay; tuned: `examples/tailsitter_tuned_0.toml`, `tailsitter_tuned.toml`, `_2`, `_3`, by delay.

RMS attitude error, median of the seeds. **Expected**: the ratio of the linear loop by Lyapunov equations, in the
weather of `paper`. **Optimum**: what a controller that knows the true spectrum of disturbance and noise would leave at
the tuned design's own disk margin and noise in the correction ([how](comparison.md#how-far-from-lqg-optimal)); its RMS
is that of the same flight with the observer off, divided by its attenuation. **Bound**: the same at any price, which
nobody can fly. **Above the optimum**: the tuned design's RMS, expected and as flown. The paper's ratios are of peaks.
"""

FLIGHTS = """
## {title}
| axis | delay | off, mrad | paper's weights: off/on, expected | tuned: on, mrad | off/on (least to most) | expected | \
optimum at its price: mrad, off/on | bound, off/on | above the optimum: expected, flown | the paper |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"""

COSTS = """
## What costs the rest
By expectation. Above the optimum: what the tuned design gives up on purpose so that its attenuation holds where the
plant's gain is not the model's (gains of 0.7 and 1.3 are in its objective), what its delay margin costs where the
optimum has less of it, and what six states cannot do. Less than none: the optimum's F is finite, of 64 states that are
given, and six that are sought do better ([tuning](tuning.md)).

Each factor is what the optimum's attenuation gains when one
thing changes (1.00: nothing). Noise, disk margin: from the optimum at the price to that with any noise, or with any
disk margin. Link: the same price, no link.

| axis | delay | disk margin, noise | above the optimum | delay margin: tuned, optimum | noise | disk margin | link |
| --- | --- | --- | --- | --- | --- | --- | --- |"""

STRENGTH = """
## What the nonlinear vehicle costs
The tuned designs at the scenario's disturbance and at half of it, where torque saturates less and angles are half as
large: off/on, median of the seeds. What gyro noise alone makes of half a disturbance shows on the linear axes: nothing.

At half strength roll and pitch give the linear ratios within 7 % in every seed. At full strength saturation and large
angles cost them up to 6 % in the median with a link and 11 % without; in the worst seed up to 23 % with a link and 32 %
without. Yaw does better on the tail-sitter than on the axis identified from it, in every seed at half strength, so its
model is what differs there. That linear yaw falls short of what is expected is the five seeds' weather.

| axis | delay | linear, half | linear | tail-sitter, half | tail-sitter | tail-sitter over linear: half, full |
| --- | --- | --- | --- | --- | --- | --- |"""


def page(found: Found) -> str:
    """The whole page."""
    lines = [HEAD.format(seeds=len(SEEDS)).rstrip("\n")]
    for scenario in SCENARIOS:
        lines += FLIGHTS.format(title=f"`{scenario}`: {load(scenario).airframe}").split("\n")
        lines += [flight_row(found, scenario, axis, delay) for axis in AXES for delay in DELAYS]
    lines += COSTS.split("\n")
    lines += [cost_row(axis, delay, found.expected["tuned", delay, axis]) for axis in AXES for delay in DELAYS]
    lines += STRENGTH.split("\n")
    lines += [strength_row(found, axis, delay) for axis in AXES for delay in DELAYS]
    return "\n".join([*lines, ""])


def flight_row(found: Found, scenario: str, axis: str, delay: int) -> str:
    """One axis of one scenario at one delay: both designs as flown, and the optimum in the same flights."""
    paper, tuned = (found.flown[Case(scenario, 1.0, name, delay, axis)] for name in ("paper", "tuned"))
    plain, best = (found.expected[name, delay, axis] for name in ("paper", "tuned"))
    off = median(tuned.off)
    ratio = load(scenario).paper_ratio
    cells = (
        axis,
        str(delay),
        f"{1e3 * off:.1f}",
        f"{paper.ratio:.1f}, {plain.design.attenuation:.1f}",
        f"{1e3 * median(tuned.on):.2f}",
        f"**{tuned.ratio:.1f}** ({min(tuned.ratios):.1f} to {max(tuned.ratios):.1f})",
        f"{best.design.attenuation:.1f}",
        f"{1e3 * off / best.at_price.attenuation:.2f}, {best.at_price.attenuation:.1f}",
        f"{best.bound.attenuation:.0f}",
        f"{_percent(best.excess)}, {_percent(tuned.above(best.at_price.attenuation))}",
        "–" if ratio is None else f"{ratio[AXES.index(axis)]:g}",
    )
    return f"| {' | '.join(cells)} |"


def cost_row(axis: str, delay: int, of: Shortfall) -> str:
    """What each single thing costs one axis of the tuned design."""
    steps = {step.name: step for step in of.steps}
    link = steps.get(NO_LINK)
    cells = (
        axis,
        str(delay),
        f"{of.design.disk_margin:.3f}, {_scientific(of.design)}",
        f"**{_percent(of.excess)}**",
        f"{of.design.delay_margin}, {of.at_price.delay_margin}",
        _gain(steps["best with any noise"], of.at_price),
        _gain(steps["best with any disk margin"], of.at_price),
        "–" if link is None else _gain(link, of.at_price),
    )
    return f"| {' | '.join(cells)} |"


def strength_row(found: Found, axis: str, delay: int) -> str:
    """One axis at half and full disturbance, linear and nonlinear."""
    cases = [Case(scenario, strength, "tuned", delay, axis) for scenario in SCENARIOS for strength in (0.5, 1.0)]
    ratios = [found.flown[case].ratio for case in cases]
    half, full = ratios[2] / ratios[0], ratios[3] / ratios[1]
    cells = (axis, str(delay), *(f"{ratio:.1f}" for ratio in ratios), f"{half:.2f}, {full:.2f}")
    return f"| {' | '.join(cells)} |"


def _gain(better: Step, than: Step) -> str:
    return f"{better.attenuation / than.attenuation:.2f}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %".replace("-", "−")


def _scientific(step: Step) -> str:
    return f"{step.noise:.2e}".replace("e-0", "e−")
