"""What a waiting daemon says, in simulated time."""

from pymavlink.dialects.v20 import common as mav

from dob_companion.cli.waiting import Waiting
from dob_companion.companion import Companion
from dob_companion.runtime import parse_link_url
from tests.companion.aircraft import small_design

UDP = "udpin:127.0.0.1:14540"
MORE = f"dob-companion doctor --link {UDP} --design d.json tells more, once this has stopped"


def lines_of(minutes, *, url=UDP, system=None, each_second=None):
    """All lines in so many minutes, with their times; `each_second` is what comes in each second."""
    companion = Companion(small_design())
    heard, now = [], 0.0
    waiting = Waiting(parse_link_url(url), system, lambda event: heard.append((now, event.text)), now, design="d.json")
    for now in range(60 * minutes):
        if each_second:
            companion.receive(each_second, now)
            waiting.received(each_second, now)
        waiting.begins(companion, now)
    return heard


def beat(component, kind, autopilot):
    sender = mav.MAVLink(None, srcSystem=1, srcComponent=component)
    return bytes(mav.MAVLink_heartbeat_message(kind, autopilot, 0, 0, 4, 3).pack(sender))


def test_it_speaks_soon_and_ever_more_rarely():
    times = [at for at, _ in lines_of(40)]
    assert times[:4] == [5, 10, 20, 40]
    assert 3 <= len([at for at in times if at >= 600]) <= 5


def test_silence_asks_whether_anybody_sends():
    first, second, *_ = (text for _, text in lines_of(1))
    silence = f"nothing has come in on {UDP}; does the autopilot send there?"
    assert first == f"no vehicle for 5 s: {silence}; {MORE}"
    assert second == f"no vehicle for 10 s: {silence}"
    assert "at this baud rate?" in lines_of(1, url="/dev/ttyAMA0")[0][1]


def test_noise_points_to_the_baud_rate_of_a_serial_line():
    assert (
        "hardly any of them MAVLink; is this the port's baud rate?"
        in (lines_of(1, url="/dev/ttyAMA0", each_second=b"\x00\xfd\x5a\x01" * 10)[0][1])
    )


def test_messages_without_an_autopilot_are_said_to_be_that():
    ground = beat(190, mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID)
    assert "but not an autopilot's heartbeat; dob-companion doctor" in lines_of(1, each_second=ground)[0][1]
    assert "heartbeat from system 7; dob-companion doctor" in lines_of(1, each_second=ground, system=7)[0][1]


def test_of_a_vehicle_that_sends_no_samples_it_says_once_why_it_waits_and_what_tells_more():
    autopilot = beat(1, mav.MAV_TYPE_QUADROTOR, mav.MAV_AUTOPILOT_PX4)
    ((at, text),) = lines_of(2, each_second=autopilot)
    assert at == 5
    assert text.startswith("waiting for gyro and moment: no samples")
    assert text.endswith(f"; {MORE}")


def test_it_falls_silent_when_samples_come():
    companion, heard = Companion(small_design()), []
    waiting = Waiting(parse_link_url(UDP), None, heard.append, 0.0)
    for k in range(1000):
        sample = mav.MAVLink_highres_imu_message(4000 * k, *[0.1] * 13, 56)
        moment = mav.MAVLink_actuator_control_target_message(4000 * k, 0, [0, 0, 0, 0.5, 0, 0, 0, -1])
        sender = mav.MAVLink(None, srcSystem=1, srcComponent=1)
        for data in (beat(1, 2, mav.MAV_AUTOPILOT_GENERIC), bytes(sample.pack(sender)), bytes(moment.pack(sender))):
            companion.receive(data, 0.01 * k)
        waiting.begins(companion, 0.01 * k)
    assert heard == []
