"""Recording, rotation, and whatever a disk, a scribe or a pipe may do meanwhile."""

import os
import resource
import signal
import subprocess
from pathlib import Path

import pytest

from dob_companion.companion import Companion
from dob_companion.errors import InputError
from dob_companion.files.recorder import CHECKPOINT_S, FlightRecorder
from dob_companion.files.segments import segments_in, traces_at
from tests.companion.aircraft import Aircraft, corrections, small_design
from tests.recorder.flights import Told, end, pairs_in_a_hurry, recorded, replayed, wait_until

WALL_S = 0.1
A_LINE = 500
"""Bytes: room for a word on stderr, not for a segment."""


def test_a_flight_replays_bit_for_bit_and_so_does_each_of_its_segments_alone(tmp_path):
    with recorded(tmp_path, mb=0.1) as plane:
        plane.active()
        plane.rates = (0.1, -0.2, 0.3)
        pairs_in_a_hurry(plane, 1200, WALL_S)
    paths = traces_at(tmp_path)
    assert len(paths) > 3
    whole, endings = replayed(*paths)
    assert whole.difference == ""
    assert whole.corrections == len(corrections(plane.said))
    assert whole.checkpoints >= len(paths) - 1  # each proves that the state was reached by computing
    assert not any(ending.torn or ending.damage for ending in endings)
    alone = [replayed(path)[0] for path in paths]
    assert [one.difference for one in alone] == [""] * len(paths)
    assert sum(one.corrections for one in alone) == whole.corrections


def test_only_so_many_segments_are_kept_and_the_oldest_go_first(tmp_path):
    with recorded(tmp_path, mb=0.1, segments=3) as plane:
        plane.heartbeat()
        pairs_in_a_hurry(plane, 2400, WALL_S)
    names = segments_in(tmp_path)
    assert len(names) == 3
    assert names[0].index > 0
    assert sorted(p.suffix for p in tmp_path.iterdir()) == [".dobtrace"] * 3 + [".tlog"] * 3
    assert sum(p.stat().st_size for p in tmp_path.iterdir()) < 3 * 0.25e6
    assert replayed(*traces_at(tmp_path))[0].difference == ""


def test_the_next_flight_gets_the_next_number_without_a_clock(tmp_path):
    for _ in range(3):
        with recorded(tmp_path) as plane:
            plane.heartbeat()
    assert [name.flight for name in segments_in(tmp_path)] == [1, 2, 3]
    assert traces_at(tmp_path)[0].name == "flight-0003-000.dobtrace"


def written(directory):
    return sum(path.stat().st_size for path in directory.iterdir()) > 5000


def until_said(capfd, words):
    """Everything on stderr up to these words: the scribe works in its own time."""
    said = []
    wait_until(lambda: said.append(capfd.readouterr().err) or words in "".join(said))
    return "".join(said)


def limit(plane, size):
    """How long a file of the scribe may be: writing beyond fails as on a full disk (but its stderr is a file here)."""
    resource.prlimit(plane.recorder.scribe, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))


def test_a_full_disk_costs_records_one_warning_and_nothing_else(tmp_path, capfd):
    with recorded(tmp_path) as plane:
        plane.active()
        wait_until(lambda: written(tmp_path))
        limit(plane, A_LINE)
        answered = len(pairs_in_a_hurry(plane, 300, WALL_S).said)
        assert answered
        said = until_said(capfd, "stopped until there is room")
        limit(plane, resource.RLIM_INFINITY)
        pairs_in_a_hurry(plane, 600, WALL_S)
    warnings = [line for line in (said + capfd.readouterr().err).splitlines() if "recorder" in line]
    assert sum("stopped until there is room" in line for line in warnings) == 1
    assert sum("recording again" in line for line in warnings) == 1
    assert plane.companion.troubles == []  # the loop was told nothing, for nothing was wrong with it
    replay, endings = replayed(*traces_at(tmp_path))
    assert replay.difference == ""
    assert endings[0].torn
    assert not endings[-1].torn
    assert 300 < replay.corrections < len(corrections(plane.said))
    assert replay.lost_turns > 0
    assert replay.lost_turns + replay.turns == plane.companion.turns


def test_a_disk_without_any_room_leaves_no_debris(tmp_path):
    with recorded(tmp_path / "flights") as plane:
        limit(plane, A_LINE)
        plane.heartbeat()
        pairs_in_a_hurry(plane, 600, WALL_S)
    assert sum(path.stat().st_size for path in (tmp_path / "flights").iterdir()) == 0


def test_a_scribe_that_stands_still_fills_the_pipe_and_not_the_loop(tmp_path):
    with recorded(tmp_path) as plane:
        plane.active()
        os.kill(plane.recorder.scribe, signal.SIGSTOP)
        plane.companion.wait_for_room = False
        while not plane.recorder.lost:
            plane.pairs(100)
        plane.pairs(100)
        os.kill(plane.recorder.scribe, signal.SIGCONT)
        plane.companion.wait_for_room = True
        pairs_in_a_hurry(plane, 100, WALL_S)
        lost = plane.recorder.lost
    assert len(plane.companion.troubles) == 1
    assert "does not keep up" in plane.companion.troubles[0]
    replay, _ = replayed(*traces_at(tmp_path))
    assert replay.difference == ""
    assert replay.lost_turns == lost
    assert replay.turns + lost == plane.companion.turns


def test_a_killed_scribe_is_said_once_and_the_flight_goes_on(tmp_path):
    with recorded(tmp_path) as plane:
        plane.active()
        wait_until(lambda: written(tmp_path))
        os.kill(plane.recorder.scribe, signal.SIGKILL)
        wait_until(lambda: plane.pair() and plane.recorder.lost)
        assert plane.pairs(100)
    assert len(plane.companion.troubles) == 1
    assert "process has ended" in plane.companion.troubles[0]
    assert replayed(*traces_at(tmp_path))[0].difference == ""


def test_a_state_that_no_checkpoint_can_hold_is_said_and_does_not_reach_the_loop(tmp_path):
    with recorded(tmp_path) as plane:
        plane.active()
        plane.companion.companion.loop.answer = memoryview(b"")
        plane.now += CHECKPOINT_S
        plane.heartbeat()
        assert "loop.answer" in plane.companion.troubles[0]


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may mount a small disk")
def test_a_real_small_disk_fills_up_and_gets_room_again(tmp_path, capfd):
    disk = tmp_path / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", disk], check=False).returncode:
        pytest.skip("mounting is not allowed here")
    try:
        ballast = disk / "ballast"
        ballast.write_bytes(bytes(150_000))
        with recorded(disk) as plane:
            plane.active()
            pairs_in_a_hurry(plane, 800, WALL_S)
            until_said(capfd, "stopped until there is room")
            (disk / "flight-0001-000.tlog").unlink()
            ballast.unlink()
            pairs_in_a_hurry(plane, 250, WALL_S)
        replay, _ = replayed(*traces_at(disk))
        assert replay.difference == ""
        assert len(traces_at(disk)) >= 2
        assert replay.lost_turns > 0
    finally:
        subprocess.run(["umount", "-l", disk], check=True)


def test_a_directory_that_cannot_be_written_is_refused_by_name(tmp_path):
    companion = Companion(small_design())
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "file", tmp_path / "file" / "below", "/proc/flights"):
        with pytest.raises(InputError, match=str(path)):
            FlightRecorder(Path(path), companion, small_design(), now=0.0)


def test_recorder_begins_in_mid_flight_as_well(tmp_path):
    companion = Companion(small_design())
    plane = Aircraft(companion).active()
    recorder = FlightRecorder(tmp_path, companion, small_design(), now=plane.now)
    plane.companion = Told(companion, recorder)
    plane.pairs(200)
    end(recorder)
    replay, _ = replayed(*traces_at(tmp_path))
    assert (replay.difference, replay.corrections) == ("", 200)
