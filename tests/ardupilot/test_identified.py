"""ArduCopter's pitch axis, excited over the link in its own simulator (our recording), against ArduPilot's own
System ID log of the same aircraft: 307.5 rad/s² per unit of torque, slow pole 2.4 rad/s."""

from dataclasses import replace

import pytest

from dob_companion.identification.identify import identify
from dob_companion.logs import read_log
from tests.ardupilot.recorded import DATA

SID_GAIN, SID_POLE = 307.5, 2.4


@pytest.fixture(scope="module")
def record():
    (record,) = read_log(DATA / "copter_excited_pitch.tlog")
    return record


def test_the_link_shows_the_plant_that_the_autopilots_own_log_shows(record):
    found = identify(record, axes=("pitch",)).axes["pitch"]
    model = found.model
    assert found.usable, found.why
    assert model.acceleration_per_unit.value == pytest.approx(SID_GAIN, rel=0.05)
    assert model.slow_pole_rad_s.value == pytest.approx(SID_POLE, abs=0.6)
    assert model.about_filters == ("INS_GYRO_FILTER = 20 Hz, second order",)
    assert model.delay_s.value < 0.003


def test_a_script_s_reading_of_the_moment_taken_as_held_would_show_another_plant(record):
    """By a quarter: half a script's period, in a loop that is closed."""
    held = identify(replace(record, moment_read_late_s=None), axes=("pitch",)).axes["pitch"].model
    assert held.acceleration_per_unit.value < 0.85 * SID_GAIN
