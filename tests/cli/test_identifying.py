"""From a table to a spec, or to the one line that says why there is none, for what is not what its names say."""

import numpy as np
import pytest

from dob_companion.artifact import AXES
from dob_companion.cli.identification_options import Options
from dob_companion.cli.identifying import of_logs
from tests.identification.hovering import Axis, fly

FLIGHT = fly([Axis(wind=1.0, noise=0.003, injected=0.04)] * 3, 60, 1)
SIGNALS = {"rate": FLIGHT.y, "moment": FLIGHT.u, "injected": FLIGHT.r}
CONTROLLER = """
[[block]]
name = "{axis}"
axes = ["{axis}"]
[block.controller]
num = [0.08, 0.05]
den = [1.0, 0.0]
domain = "s"
method = "tustin"
"""


def outcome(folder, *, controlled=True, **changed):
    """Of the flight with some signals changed."""
    columns = {
        f"{axis}_{name}": values[:, k]
        for name, values in (SIGNALS | changed).items()
        for k, axis in enumerate(AXES)
    }  # fmt: skip
    np.savez(folder / "flight.npz", time_s=0.004 * np.arange(len(FLIGHT.y)), **columns)
    spec = folder / "controllers.toml"
    auto = "[auto]\nattitude_gain = 4.0\n"
    spec.write_text(auto + "".join(CONTROLLER.format(axis=axis) for axis in AXES), encoding="utf-8")
    return of_logs([folder / "flight.npz"], Options(controller=spec if controlled else None))


def with_roll(values, name):
    return {name: np.column_stack((values, SIGNALS[name][:, 1:]))}


def test_a_flight_that_is_what_it_says_gives_a_spec(tmp_path):
    found = outcome(tmp_path)
    assert found.found.usable == AXES
    assert found.spec is not None, found.why


def test_without_the_controllers_there_is_a_model_but_no_spec_and_it_says_what_to_give(tmp_path):
    found = outcome(tmp_path, controlled=False)
    assert found.found.usable == AXES
    assert found.spec is None
    assert "no parameters of the autopilot in it" in found.why
    assert "--params FILE, or --controller SPEC.toml" in found.why


@pytest.mark.parametrize(
    "changed",
    [
        {"rate": np.degrees(FLIGHT.y)},
        {"moment": 5.0 * FLIGHT.u, "injected": 5.0 * FLIGHT.r},
        {"injected": -FLIGHT.r},
        {"rate": 0.004 * np.cumsum(FLIGHT.y, axis=0)},
    ],
    ids=["degrees", "another unit of torque", "injected backwards", "angles for rates"],
)
def test_what_closes_the_loop_in_a_record_of_other_units_is_not_the_controller_and_there_is_no_spec(tmp_path, changed):
    found = outcome(tmp_path, **changed)
    assert found.spec is None
    assert any(words in found.why for words in ("the rate loop", "no axis is usable"))
    assert "\n" not in found.why


@pytest.mark.parametrize(
    "changed",
    [
        with_roll(-FLIGHT.y[:, 0], "rate"),
        with_roll(-FLIGHT.u[:, 0], "moment"),
        {"rate": FLIGHT.y[:, [1, 0, 2]]},
        {"rate": FLIGHT.y[:, [1, 0, 2]], "moment": FLIGHT.u[:, [1, 0, 2]]},
    ],
    ids=["gyro flipped", "moment flipped", "gyros swapped", "gyros and moments swapped"],
)
def test_where_one_axis_is_mistaken_for_another_there_is_no_spec_for_the_rest(tmp_path, changed):
    found = outcome(tmp_path, **changed)
    assert found.spec is None
    assert "mistaken for others" in found.why
