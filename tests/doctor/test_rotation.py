"""Which axes a vehicle measures its rates in: named in hover, and never where they are right."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.doctor.finding import Verdict
from dob_companion.doctor.rotation import RotationSearch
from dob_companion.mavlink.axes import HOVER, ROTATIONS, VehicleAxes
from sitl.calibration import disturbance_scale
from sitl.scenario.spec import load, packaged_names
from tests.companion.aircraft import small_design
from tests.companion.test_axes import FORWARD
from tests.doctor.road import Road
from tests.scenarios.designs import design_for
from tests.supervisor.test_axes import STATED_S, flown_off


def said(y, u, design=None):
    """Everything that is found, asked ten times a second."""
    search, found = RotationSearch(design or design_for(1)), set()
    for k, (rates, moment) in enumerate(zip(y.tolist(), u.tolist(), strict=True)):
        search.add(rates, moment)
        if k % 25 == 24:
            found.add(search.found())
    return found


@pytest.fixture(scope="module")
def hover():
    """Seconds of a disturbed hover, as long as an error may take to be named."""
    y, u = flown_off("paper", 1, 14.0, scale=(0.1, 0.1, 0.1))
    last = round(STATED_S / 0.004)
    return y[-last:], u[-last:]


@pytest.mark.parametrize("turn", ROTATIONS[::5], ids=str)
def test_a_rotation_is_named_in_a_disturbed_hover_and_no_other(hover, turn):
    y, u = hover
    measured = np.array([turn.outward(tuple(rates)) for rates in y.tolist()])
    assert said(measured, u) - {None} == {turn} - {HOVER}


@pytest.mark.parametrize("spoil", [[1, -1, 1], [-1, -1, -1], [57.3, 57.3, 57.3]], ids=["mirrored", "all", "deg/s"])
def test_what_is_no_rotation_is_named_as_none(hover, spoil):
    y, u = hover
    assert said(y * spoil, u) == {None}


def test_an_aircraft_that_does_not_move_beyond_its_noise_proves_nothing():
    y, u = flown_off("paper", 1, 8.0)
    assert said(np.roll(y[-1500:], 1, axis=1), u[-1500:]) == {None}
    assert said(np.zeros((1000, 3)), np.full((1000, 3), 0.3), small_design()) == {None}


@pytest.mark.parametrize(("name", "seed", "seconds"), [("gust", 1, 34.0), ("dryden", 2, 14.0)])
def test_gusts_and_turbulence_are_no_rotation(name, seed, seconds):
    assert said(*flown_off(name, seed, seconds)) == {None}


@pytest.mark.proof
@pytest.mark.parametrize("seed", [1])
@pytest.mark.parametrize("name", [name for name in packaged_names() if load(name).windows])
def test_no_scenario_is_taken_for_another_rotation(name, seed):
    scenario = load(name)
    windows = scenario.windows
    assert said(*flown_off(name, seed, windows.lead_s + windows.length_s, disturbance_scale(scenario, seed))) == {None}


class Turned(Road):
    """Its gyro is that of forward flight; its moments answer hover's rates by the small design's controller."""

    def sample(self, now, stamp, k):
        rates = tuple(math.sin(f * k) + math.sin(1.7 * f * k) for f in (0.3, 0.21, 0.13))
        moment = [*(-0.1 * rate for rate in rates), 0.5, 0, 0, 0, -1]
        self.at(now, mav.MAVLink_highres_imu_message(stamp, 0, 0, 0, *FORWARD.outward(rates), *[0] * 7, 56))
        self.at(now, mav.MAVLink_actuator_control_target_message(stamp, 0, moment))


def test_doctor_names_the_map_that_fits_and_is_content_with_it():
    wrong, _ = Turned(design=small_design()).listen(seconds=4.0)
    (signs,) = [finding for finding in wrong.findings if finding.topic == "signs"]
    assert (wrong.fit, signs.verdict) == (False, Verdict.MISSING)
    assert 'gyro = ["roll", "pitch", "yaw"]' in signs.text
    assert '[axes] gyro = ["yaw", "pitch", "-roll"]' in signs.remedy
    right, _ = Turned(design=small_design(), axes=VehicleAxes(FORWARD)).listen(seconds=4.0)
    assert [f.text for f in right.findings if f.topic == "signs"] == [
        "rates and moments of all axes belong together as the design says"
    ]
