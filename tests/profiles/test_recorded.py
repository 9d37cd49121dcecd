"""A recording says which profile was asked for, and is replayed and read with it."""

import gzip

import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.analysis.recorded import FlightReader
from dob_companion.artifact import dumps
from dob_companion.companion import Companion, CompanionConfig, parse_config
from dob_companion.errors import ConfigError, InputError
from dob_companion.files.playback import play, play_chunks
from dob_companion.files.recorder import FlightRecorder
from dob_companion.files.trace import SCHEMA, Kind, frame, json_item
from dob_companion.flightlog.replay import Replay
from dob_companion.mavlink import profiles
from tests.companion.aircraft import Aircraft, small_design
from tests.recorder.flights import Told, wait_until


def flown(directory, asked):
    """The first segment of a short flight: of a PX4 aircraft, unless it is asked to be flown as `sitl`."""
    companion = Companion(small_design(), CompanionConfig(profile=asked))
    recorder = FlightRecorder(directory, companion, small_design(), now=0.0, profile=asked)
    make = mav.MAV_AUTOPILOT_GENERIC if asked == "sitl" else mav.MAV_AUTOPILOT_PX4
    plane = Aircraft(Told(companion, recorder), autopilot=make)
    plane.pairs(300)
    recorder.close()
    path = min(directory.glob("*.dobtrace"))
    wait_until(lambda: _whole(path))  # on a busy machine the scribe may end later than the recorder waits for it
    return path, companion.profile


def _whole(path):
    try:
        return not play(path, Replay()).torn
    except InputError:
        return False


@pytest.mark.parametrize("asked", ["auto", "px4", "sitl"])
def test_a_flight_is_the_same_again_with_the_profile_that_was_asked_for(tmp_path, asked):
    path, profile = flown(tmp_path, asked)
    assert profile.name == ("sitl" if asked == "sitl" else "px4")
    replay, reader = Replay(), FlightReader()
    play(path, replay)
    play(path, reader)
    assert (replay.difference, replay.corrections) == ("", 300)
    assert len(reader.flight("flight").gyro) == 300


class Asked(Replay):
    """Keeps what the header says."""

    def began(self, segment):
        self.profile = segment.profile


def header(**more):
    values = {
        "schema": SCHEMA, "generator": "", "machine": "", "started": "", "unix_offset": 0.0, "flight": 1,
        "datagrams": True, "config": "", "design": "{}",
    }  # fmt: skip
    return [gzip.compress(frame([json_item(Kind.HEADER, values | more)]))]


def test_a_recording_from_before_there_was_a_choice_was_flown_with_sitl():
    replay = Asked()
    play_chunks(header(), replay, "old")
    assert replay.profile == "sitl"


def test_a_recording_of_a_profile_that_this_program_does_not_have_is_refused():
    design = dumps(small_design())[0]
    with pytest.raises(InputError, match="profile 'rover', expected auto or sitl"):
        play_chunks(header(profile="rover", design=design), Replay(), "new")


def test_a_configuration_may_ask_for_a_profile_and_only_for_one_that_there_is():
    for name in profiles.NAMES:
        assert parse_config(f'profile = "{name}"', "c.toml").profile == name
    with pytest.raises(ConfigError, match=r"c.toml: profile: expected one of auto, sitl, ardupilot, px4, got 'rover'"):
        parse_config('profile = "rover"', "c.toml")
    with pytest.raises(ConfigError, match=r"c.toml: profile: expected .*, got \[\]"):
        parse_config("profile = []", "c.toml")
