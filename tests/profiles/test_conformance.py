"""What every profile must bring, whoever adds one: the registry is the list of cases."""

import dataclasses
import math
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common as mav

from dob_companion.cli import run
from dob_companion.companion import Companion, CompanionConfig
from dob_companion.flightlog.snapshot import Snapshots, difference, restore
from dob_companion.mavlink import (
    CORRECTION_MESSAGES,
    AppliedMoment,
    Codec,
    FlightState,
    GyroSample,
    Input,
    Landed,
    RcChannels,
    makes,
    profiles,
    stream_requests,
)
from dob_companion.mavlink.profiles import AgeSource
from tests.companion.aircraft import Aircraft, corrections, small_design
from tests.doctor.road import Road

STAMP = 123_456_789
BRINGS = {
    GyroSample: Input.GYRO,
    AppliedMoment: Input.MOMENT,
    FlightState: Input.FLIGHT_STATE,
    RcChannels: Input.RC_CHANNELS,
}
MAKES = {
    makes.ARDUPILOT: mav.MAV_AUTOPILOT_ARDUPILOTMEGA,
    makes.PX4: mav.MAV_AUTOPILOT_PX4,
    makes.GENERIC: mav.MAV_AUTOPILOT_GENERIC,
    makes.OTHER: mav.MAV_AUTOPILOT_PPZ,
}
SPECIAL = {
    "time_usec": STAMP, "time_boot_ms": 1234, "group_mlx": 0, "landed_state": 2, "vtol_state": 3, "name": b"DOB_ACT",
}  # fmt: skip


def packed(layout, by=None):
    """A real message of this kind by an autopilot: each number its own, those that mean something as they should be."""
    lengths = dict(zip(layout.ordered_fieldnames, layout.array_lengths, strict=True))
    values = []
    for number, name in enumerate(layout.fieldnames, start=1):
        array = [0.01 * (number + k) for k in range(lengths[name])]
        values.append(SPECIAL.get(name, array or number))
    return bytes(layout(*values).pack(by or mav.MAVLink(None, srcSystem=1, srcComponent=1)))


@pytest.fixture(params=profiles.PROFILES, ids=lambda profile: profile.name)
def profile(request):
    return request.param


def heard_by(profile):
    """A heartbeat's number of an autopilot that this profile is for."""
    return MAKES[profile.makes[0]] if profile.makes else mav.MAV_AUTOPILOT_GENERIC


class TestEveryProfile:
    def test_cannot_be_changed(self, profile):
        with pytest.raises(dataclasses.FrozenInstanceError):
            profile.name = "another"

    def test_says_everything_that_a_person_needs(self, profile):
        assert profile.remedy.strip() == profile.remedy != ""
        assert "\n" not in profile.remedy + profile.speed_remedy
        assert profile.name == profile.name.strip().lower() != ""
        assert set(profile.makes) <= set(MAKES)

    def test_wants_each_input_once_with_the_number_of_its_name(self, profile):
        assert sorted(s.brings.name for s in profile.streams) == sorted(i.name for i in Input)
        for stream in profile.streams:
            assert stream.message == getattr(mav, f"MAVLINK_MSG_ID_{stream.name}")
            assert stream.interval_us is None or stream.interval_us > 0
        for name in profile.also_heard:
            assert hasattr(mav, f"MAVLINK_MSG_ID_{name}")

    def test_asks_for_rates_and_moments_at_the_rate_of_the_design(self, profile):
        wanted = {r.brings: r.interval_us for r in stream_requests(profile, 0.004, kill_switch=True)}
        assert wanted[Input.GYRO] == wanted[Input.MOMENT] == 4000
        assert wanted.keys() == set(Input)
        without = {r.brings for r in stream_requests(profile, 0.004, kill_switch=False)}
        assert without == set(Input) - {Input.RC_CHANNELS}

    def test_reads_every_stream_that_it_wants(self, profile):
        assert {stream.message for stream in profile.streams} == set(profile.readers)
        for number, reader in profile.readers.items():
            assert reader.layout.id == number
            assert profile.layouts[number] is reader.layout

    @pytest.mark.parametrize("datagrams", [True, False])
    def test_reads_finite_facts_from_real_messages_whole_or_in_pieces(self, profile, datagrams):
        for stream in profile.streams:
            codec = Codec(1, profile=profile, datagrams=datagrams)
            data = packed(profile.readers[stream.message].layout)
            pieces = [data] if datagrams else [data[:5], data[5:]]
            (fact,) = [fact for piece in pieces for fact in codec.facts(piece)]
            assert BRINGS[type(fact)] is stream.brings
            assert codec.counters.bad == codec.counters.foreign == 0
            match fact:
                case GyroSample():
                    assert fact.stamp_us == STAMP
                    assert all(map(math.isfinite, fact.rates))
                    assert len(fact.rates) == 3
                case AppliedMoment():
                    assert fact.stamp_us == STAMP
                    assert all(map(math.isfinite, (*fact.moment, fact.thrust, *fact.correction)))
                    assert (len(fact.moment), len(fact.correction)) == (3, 3)
                    assert math.isfinite(fact.age_samples) == (profile.age is AgeSource.REPORTED)
                case FlightState():
                    assert fact == FlightState(Landed.IN_AIR, False)
                case RcChannels():
                    assert len(fact.pulses_us) == 18

    def test_takes_them_from_the_autopilot_of_its_vehicle_only(self, profile):
        for reader in profile.readers.values():
            for system, component in ((2, 1), (1, 2)):
                codec = Codec(1, profile=profile)
                data = packed(reader.layout, mav.MAVLink(None, srcSystem=system, srcComponent=component))
                assert list(codec.facts(data)) == []
                assert codec.counters.foreign == 1

    @given(st.binary(max_size=300))
    def test_survives_garbage_in_any_field(self, garbage):
        for profile in profiles.PROFILES:
            for reader in profile.readers.values():
                size = reader.layout.unpacker.size
                reader.fact(reader.layout.unpacker.unpack(garbage[:size].ljust(size, b"\0")))
            list(Codec(1, profile=profile).facts(garbage))

    def test_sends_its_correction_in_a_message_that_can_be_sent(self, profile):
        assert profile.carrier in CORRECTION_MESSAGES

    def test_tells_in_the_air_from_landed_and_hover_from_forward_flight(self, profile):
        rule = profile.landed
        assert {*rule.states.values()} >= {Landed.ON_GROUND, Landed.IN_AIR}
        assert rule.read((mav.MAV_VTOL_STATE_MC, 255)) == FlightState(Landed.UNKNOWN, False)
        assert rule.read((mav.MAV_VTOL_STATE_FW, mav.MAV_LANDED_STATE_IN_AIR)).forward
        assert mav.MAV_STATE_STANDBY in rule.standing_by
        assert not rule.standing_by & {mav.MAV_STATE_CRITICAL, mav.MAV_STATE_EMERGENCY}

    def test_has_the_rate_that_a_design_is_checked_for_before_the_autopilot_is_known(self, profile):
        assert profile.rate_hz == profiles.rate_hz(profiles.AUTO) == profiles.rate_hz(profile.name)

    @pytest.mark.parametrize("asked", ["by name", "auto"])
    def test_is_flown_asked_for_by_name_or_recognized(self, profile, asked):
        config = CompanionConfig(profile=profile.name if asked == "by name" else "auto")
        plane = Flying(profile, config).active()
        assert plane.companion.profile is profile
        plane.rates = (0.1, 0.0, 0.0)
        plane.pairs(50)
        assert any(c.x for c in plane.pairs(2))

    def test_a_flight_with_it_is_taken_up_again_from_a_snapshot(self, profile):
        def newborn():
            return Companion(small_design(), CompanionConfig())

        plane, other, snapshots = Flying(profile, CompanionConfig()), newborn(), Snapshots(newborn())
        plane.active()
        state = snapshots.take(plane.companion)
        restore(other, state)
        assert other.profile is profile
        assert difference(state, snapshots.take(other)) == ""

    def test_doctor_judges_a_vehicle_by_it(self, profile):
        moments = profile.stream(Input.MOMENT).name
        good, listening = Road(autopilot=heard_by(profile), moment_name=moments).listen()
        assert (good.fit, good.profile) == (True, profile.name)
        assert set(listening.answers) >= {s.name for s in profile.streams if s.interval_us is None}
        bare, _ = Road(autopilot=heard_by(profile), moments=False).listen()
        assert not bare.fit
        assert profile.remedy in [f.remedy for f in bare.findings if f.topic == "profile"]


class Flying(Aircraft):
    """Beats as an autopilot that the profile is for."""

    def __init__(self, profile, config):
        super().__init__(Companion(small_design(), config), autopilot=heard_by(profile))


def test_names_are_unique_and_those_of_the_command_line():
    assert len({*profiles.NAMES}) == len(profiles.NAMES)
    assert run.PROFILES == profiles.NAMES


def test_the_contract_lists_them_all():
    text = (Path(__file__).parents[2] / "docs" / "interfaces.md").read_text(encoding="utf-8")
    listed = re.search(r"### Profiles\n(.*?)\n### ", text, flags=re.DOTALL).group(1)
    assert re.findall(r"^\| `(\w+)`", listed, flags=re.MULTILINE) == list(profiles.NAMES)


def test_no_make_is_claimed_by_two():
    claimed = [make for profile in profiles.PROFILES for make in profile.makes]
    assert len(claimed) == len({*claimed})


@pytest.mark.parametrize("make", MAKES)
def test_an_autopilot_that_no_profile_is_made_for_is_flown_by_the_contract(make):
    claimed = {make: profile for profile in profiles.PROFILES for make in profile.makes}
    assert profiles.choose("auto", make) is claimed.get(make, profiles.FALLBACK)
    assert profiles.choose(profiles.FALLBACK.name, make) is profiles.FALLBACK


def test_an_autopilot_of_another_make_than_asked_for_is_refused_in_one_line_and_gets_nothing():
    plane = Aircraft(Companion(small_design(), CompanionConfig(profile="ardupilot")))
    for _ in range(3):
        plane.heartbeat()
        assert plane.pairs(10) == []
    assert plane.companion.vehicle is None
    texts = [event.text for event in plane.companion.events()]
    assert texts.count("system 1 is generic, profile ardupilot is for ArduPilot: not obeyed") == 1
    plane.deliver(mav.MAVLink_heartbeat_message(2, mav.MAV_AUTOPILOT_ARDUPILOTMEGA, 0, 0, 4, 3))
    assert plane.companion.vehicle == 1
    assert len(corrections(plane.deliver(plane.imu(), plane.target()))) == 1


def test_doctor_says_that_run_would_not_obey_another_make_than_asked_for():
    diagnosis, _ = Road(autopilot=mav.MAV_AUTOPILOT_PX4, profile="ardupilot").listen()
    (finding,) = [f for f in diagnosis.findings if f.topic == "profile"]
    assert not diagnosis.fit
    assert "not for PX4" in finding.text
    assert finding.remedy == "--profile auto"


def test_the_vehicle_that_takes_the_place_of_another_is_flown_by_its_own():
    plane = Aircraft(Companion(small_design(), CompanionConfig()))
    plane.heartbeat()
    assert plane.companion.profile.name == "sitl"
    plane.now += 20.0
    other = mav.MAVLink(None, srcSystem=2, srcComponent=1)
    plane.deliver(mav.MAVLink_heartbeat_message(2, mav.MAV_AUTOPILOT_ARDUPILOTMEGA, 0, 0, 4, 3), by=other)
    assert (plane.companion.vehicle, plane.companion.profile.name) == (2, "ardupilot")
