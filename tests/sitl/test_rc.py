"""The simulated vehicle's RC channels: told when asked for, moved as a ground station moves them."""

from pymavlink.dialects.v20 import common as mavlink

from dob_companion.companion import Companion, CompanionConfig
from dob_companion.supervisor import RegimeLimits, State
from sitl.wire.endpoint import COMPANION, GROUND
from tests.scenarios.designs import design_for
from tests.sitl.bench import command
from tests.sitl.wire import ACCEPTED, Wire

RC = mavlink.MAVLINK_MSG_ID_RC_CHANNELS
UNTOUCHED, LEFT, RELEASED = 65535, 0, 65534


def override(**channels):
    """As MAVProxy sends it; what is not named is left as it is."""
    pulses = [channels.get(f"ch{n}", UNTOUCHED) for n in range(1, 19)]
    return mavlink.MAVLink_rc_channels_override_message(1, 1, *pulses)


def pulses(wire):
    wire.step()
    wire.say(GROUND, command(mavlink.MAV_CMD_REQUEST_MESSAGE, RC))
    (told,) = [m for m in wire.take(GROUND) if m.get_type() == "RC_CHANNELS"]
    return [getattr(told, f"chan{n}_raw") for n in range(1, 1 + told.chancount)]


def test_sticks_stand_in_the_middle_and_switches_are_down():
    assert pulses(Wire()) == [1500] * 4 + [1000] * 14


def test_a_ground_station_moves_a_channel_and_lets_it_go():
    wire = Wire()
    wire.say(GROUND, override(ch7=2000, ch12=1800))
    assert [pulses(wire)[n - 1] for n in (1, 7, 12)] == [1500, 2000, 1800]
    wire.say(GROUND, override(ch7=LEFT, ch12=LEFT))  # beyond the eighth, 0 leaves a channel as it is
    assert [pulses(wire)[n - 1] for n in (7, 12)] == [1000, 1800]
    wire.say(GROUND, override(ch12=RELEASED))
    assert pulses(wire)[11] == 1000


def test_they_are_a_stream_only_when_asked_for():
    wire = Wire()
    wire.meet()
    assert not [m for _ in range(250) for m in wire.step() if m.get_type() == "RC_CHANNELS"]
    wire.say(COMPANION, command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, RC, 200_000.0))
    wire.take(COMPANION)
    told = [m for _ in range(250) for m in wire.step() if m.get_type() == "RC_CHANNELS"]
    assert len(told) == 5


def test_a_kill_switch_can_be_tried_against_it():
    """A companion with a kill switch on channel 7 asks for it, flies, and lets go when it is thrown."""
    wire, companion = Wire(), Companion(design_for(1), CompanionConfig(regime=RegimeLimits(kill_channel=7)))
    ground = mavlink.MAVLink(None, 255, 190)

    def fly(seconds):
        for _ in range(round(250 * seconds)):
            now = 1e-6 * wire.flight.vehicle.now_us
            wire.endpoint.advance(now)
            wire.endpoint.step()
            for datagram in wire.endpoint.bytes_to_send(COMPANION):
                companion.receive(datagram, now)
            companion.advance(now)
            for message in companion.bytes_to_send():
                wire.endpoint.receive(COMPANION, message)

    assert wire.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == ACCEPTED
    assert wire.result(mavlink.MAV_CMD_NAV_TAKEOFF) == ACCEPTED
    fly(1.0)
    switch_on = mavlink.MAVLink_param_set_message(1, 191, b"DOB_ENABLE", 1.0, 9)
    wire.endpoint.receive(GROUND, switch_on.pack(ground))
    fly(9.0)
    assert companion.status().state is State.ACTIVE, companion.status().why
    wire.say(GROUND, override(ch7=2000))
    fly(1.0)
    assert not companion.status().state.injecting
    assert companion.status().why == "killed by RC channel 7"
