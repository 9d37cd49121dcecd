"""The shipped tuned specs beside the weights that they replaced and beside what any observer can reach."""

from collections.abc import Iterator
from pathlib import Path

from dob_companion.artifact import DobBlock
from dob_companion.comparison.flight import expect
from dob_companion.comparison.vehicle import Vehicle, close, no_observer
from dob_companion.synthesis import design_from_toml, parse_spec
from dob_companion.synthesis.plant.models import from_data

EXAMPLES = Path(__file__).parents[1] / "examples"
SPECS = {
    0: "tailsitter_tuned_0.toml",
    1: "tailsitter_tuned.toml",
    2: "tailsitter_tuned_2.toml",
    3: "tailsitter_tuned_3.toml",
}
"""By link delay, samples; the linear axes and the nonlinear tail-sitter share their models."""

GAINS = (0.7, 1.0, 1.3)

BEFORE = {
    ("pitch", 0): (20.957, 24.571, 25.772, 20.972),
    ("roll", 0): (22.000, 24.030, 24.818, 22.987),
    ("yaw", 0): (52.173, 52.572, 52.649, 51.452),
    ("pitch", 1): (13.483, 15.432, 16.110, 13.609),
    ("roll", 1): (14.254, 15.793, 16.394, 15.081),
    ("yaw", 1): (24.203, 24.688, 24.874, 24.178),
    ("pitch", 2): (9.820, 11.800, 12.462, 10.139),
    ("roll", 2): (10.964, 12.612, 13.231, 11.852),
    ("yaw", 2): (17.089, 17.674, 17.924, 17.232),
    ("pitch", 3): (7.837, 9.255, 9.745, 8.090),
    ("roll", 3): (8.370, 9.764, 10.288, 9.155),
    ("yaw", 3): (12.300, 12.907, 13.177, 12.527),
}
"""(axis, samples of link delay): attenuation in the paper's weather of the searched weights that stood in these files,
at 0.7, 1 and 1.3 of the plant's gain, and with one sample of delay that nobody reports."""


def attenuations(block: DobBlock, dt: float, rms: float) -> tuple[float, ...]:
    """As in BEFORE, by the Lyapunov equations of the closed loop, the disturbance of that RMS."""
    plant, controller, observer = (
        from_data(data, dt) for data in (block.problem.plant, block.problem.controller, block.observer)
    )
    vehicle = Vehicle(plant, controller, block.delay_samples)

    def of(there: Vehicle, unseen: int = 0) -> float:
        off, on = expect(close(there, no_observer(dt)), rms), expect(close(there, observer, unseen=unseen), rms)
        assert off is not None
        return off.attitude / on.attitude if on is not None else 0.0

    return *(of(vehicle.with_gain(gain)) for gain in GAINS), of(vehicle, 1)


def shipped_table() -> Iterator[str]:
    """A row for each axis and delay."""
    yield "| axis, delay | searched weights: gain 0.7, 1, 1.3; late | shipped | states | bound | shipped of it |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for delay, name in SPECS.items():
        text = (EXAMPLES / name).read_text("utf-8")
        asked = {block.name: block.auto for block in parse_spec(text).blocks}
        design = design_from_toml(text, name)
        for block in design.blocks:
            auto, extra = asked[block.name], block.certificate.extra
            assert auto is not None
            now = attenuations(block, design.dt, auto.disturbance_rms or 0.0)
            reached, limit = (float(str(extra[key])) for key in ("attenuation", "attenuation_limit"))
            cells = (_cells(BEFORE[block.name, delay]), _cells(now), str(block.observer.order), f"{limit:.2f}")
            yield f"| {block.name}, {delay} | {' | '.join(cells)} | {100.0 * reached / limit:.1f} % |"


def _cells(values: tuple[float, ...]) -> str:
    *gains, late = (f"{value:.1f}" for value in values)
    return f"{', '.join(gains)}; {late}"
