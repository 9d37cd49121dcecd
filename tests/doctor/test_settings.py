"""What doctor reads in an autopilot's parameters: its version, the filters that matter, script or module, each cure."""

import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.cli.doctor import _as_text
from dob_companion.doctor.diagnosis import Verdict
from tests.doctor.road import Road
from tests.doctor.test_diagnosis import missing, texts

COPTER = {
    "INS_GYRO_FILTER": 20,
    "SCHED_LOOP_RATE": 400,
    "SCR_ENABLE": 1,
    "FRAME_CLASS": 17,
    "DOBC_ENABLE": 1,
    "DOBC_FRAME": 1,
    "DOBC_RATE": 250,
}
QUAD = {
    "IMU_GYRO_CUTOFF": 40,
    "IMU_DGYRO_CUTOFF": 20,
    "IMU_GYRO_RATEMAX": 400,
    "IMU_INTEG_RATE": 250,
    "MC_BAT_SCALE_EN": 0,
    "CA_AIRFRAME": 0,
    "DOBC_EN": 1,
}


def told(parameters, **changed):
    """The diagnosis, and what is printed, of an autopilot with these parameters, None for one that it does not have."""
    copter = parameters is COPTER
    values = {name: value for name, value in {**parameters, **changed}.items() if value is not None}
    road = Road(
        autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA if copter else mav.MAV_AUTOPILOT_PX4,
        moment_name="ACTUATOR_CONTROL_TARGET" if copter else "DEBUG_FLOAT_ARRAY",
        parameters=values,
        version=0x04060200 if copter else 0x011000FF,
    )
    diagnosis, listening = road.listen(1.0)
    assert not [m for m in road.sent if m.get_type() == "PARAM_SET"]
    return diagnosis, list(_as_text(listening, diagnosis))


def test_an_ardupilot_with_all_in_place_is_named_with_version_and_filter():
    diagnosis, lines = told(COPTER)
    assert diagnosis.fit
    assert "ArduPilot 4.6.2 dev autopilot of a quadrotor" in texts(diagnosis, "autopilot")
    assert "INS_GYRO_FILTER 20 Hz: it belongs to the plant" in texts(diagnosis, "filters")
    assert max(map(len, lines)) <= 80


def test_a_px4_with_all_in_place_is_named_with_version_and_filters():
    diagnosis, lines = told(QUAD)
    assert diagnosis.fit
    assert "PX4 1.16.0 autopilot" in texts(diagnosis, "autopilot")
    assert "IMU_GYRO_CUTOFF 40 Hz, IMU_DGYRO_CUTOFF 20 Hz: in the controller" in texts(diagnosis, "filters")
    assert max(map(len, lines)) <= 80


@pytest.mark.parametrize(
    ("parameters", "changed", "topic", "cure"),
    [
        (COPTER, {"SCR_ENABLE": 0}, "script", "SCR_ENABLE 1, reboot"),
        (COPTER, {"DOBC_ENABLE": None}, "script", "dob_correction.lua to APM/scripts, reboot"),
        (COPTER, {"FRAME_CLASS": 2}, "script", "DOBC_FRAME 2, FRAME_CLASS 17, reboot"),
        (COPTER, {"DOBC_FRAME": 0}, "script", "DOBC_FRAME 1 quad, 2 hexa, 3 octa; reboot"),
        (COPTER, {"DOBC_RATE": 400}, "script", "DOBC_RATE 250"),
        (QUAD, {"DOBC_EN": None}, "module", "build PX4 with deploy/px4 (docs/px4.md)"),
        (QUAD, {"DOBC_EN": 0}, "module", "DOBC_EN 1, reboot"),
        (QUAD, {"CA_AIRFRAME": 2}, "module", "fly it without the companion"),
        (QUAD, {"IMU_INTEG_RATE": 200}, "rate loop", "IMU_INTEG_RATE 250"),
    ],
)
def test_what_keeps_it_from_flying_is_missing_with_its_cure_in_a_line(parameters, changed, topic, cure):
    diagnosis, lines = told(parameters, **changed)
    assert not diagnosis.fit
    (finding,) = missing(diagnosis, topic)
    assert finding.remedy == cure
    assert f"{'':25}→ {cure}" in lines


@pytest.mark.parametrize(
    ("parameters", "changed", "topic"),
    [
        (COPTER, {"DOBC_ENABLE": 0}, "script"),
        (COPTER, {"SCHED_LOOP_RATE": 300}, "rate loop"),
        (QUAD, {"MC_BAT_SCALE_EN": 1}, "rate loop"),
    ],
)
def test_what_one_may_want_is_a_note_with_its_cure(parameters, changed, topic):
    diagnosis, _ = told(parameters, **changed)
    assert diagnosis.fit
    (note,) = [f for f in diagnosis.findings if f.topic == topic and f.verdict is Verdict.NOTE]
    assert note.remedy


def test_parameters_that_others_ask_for_are_let_pass():
    strange = mav.MAVLink_param_value_message(b"STRANGE", 1.0, 9, 900, 1)
    road = Road(autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA, parameters=COPTER, extra=((None, strange),))
    assert set(road.listen(1.0)[1].parameters) == set(COPTER)


def test_an_autopilot_that_tells_no_parameter_is_not_judged_by_them():
    diagnosis, _ = told(COPTER, **dict.fromkeys(COPTER))
    assert diagnosis.fit
    assert "parameters are not told" in texts(diagnosis, "filters")
    assert texts(diagnosis, "script") == ""
