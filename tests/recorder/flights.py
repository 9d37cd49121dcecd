"""A recorded flight in simulated time: companion and recorder called as by the loop, the scribe a real process."""

import fcntl
import struct
import termios
import time
from contextlib import contextmanager

from dob_companion.cli.main import main
from dob_companion.companion import Companion
from dob_companion.files.playback import play
from dob_companion.files.recorder import FlightRecorder
from dob_companion.flightlog.replay import Replay
from tests.cli.processes import PATIENCE_S
from tests.companion.aircraft import Aircraft, small_design

HALF_A_PIPE = 1 << 19
LOOK_S = 0.002
"""Between two looks at what another process does, which needs the processor meanwhile."""


class Told:
    """The loop's part: each call goes to the companion and to the recorder, each `advance` ends a turn."""

    def __init__(self, companion, recorder):
        self.companion, self.recorder = companion, recorder
        self.troubles = []
        self.turns = 0
        self._now = 0.0
        self.wait_for_room = True

    def __getattr__(self, name):
        return getattr(self.companion, name)

    def receive(self, data, now):
        self.companion.receive(data, now)
        self.recorder.received(data, now)

    def advance(self, now):
        self._now = now
        self.companion.advance(now)
        self.recorder.advanced(now)

    def bytes_to_send(self):
        out = self.companion.bytes_to_send()
        if out:
            self.recorder.said(out)
        for event in self.companion.events():
            self.recorder.event(event)
        trouble = self.recorder.turned(self.companion, self._now, 1e-4)
        self.turns += 1
        self.troubles += [trouble] * bool(trouble)
        while self.wait_for_room and pending(self.recorder) > HALF_A_PIPE:
            time.sleep(LOOK_S)
        return out


def pending(recorder):
    """Bytes that the scribe has not taken yet."""
    return struct.unpack("i", fcntl.ioctl(recorder._pipe._fd, termios.FIONREAD, b"\0" * 4))[0]


@contextmanager
def recorded(directory, **sizes):
    """An aircraft whose companion is recorded; on leaving, the recorder has ended."""
    companion = Companion(small_design())
    recorder = FlightRecorder(directory, companion, small_design(), now=0.0, **sizes)
    plane = Aircraft(Told(companion, recorder))
    plane.recorder = recorder
    try:
        yield plane
    finally:
        end(recorder)


def end(recorder):
    """Close it, and wait for its scribe as long as that takes: the recorder itself leaves before a late one."""
    recorder.close()
    recorder._pipe._process.wait()


def pairs_in_a_hurry(plane, count, wall_s=0.05):
    """Samples of 4 ms on the vehicle's clock while much more wall time passes, so that checkpoints come soon."""
    for number in range(count):
        if number % 10 == 0:
            plane.heartbeat()
        plane.pair()
        plane.now += wall_s
    return plane


def replayed(*paths):
    """A replay of segments, and how the reading of each ended."""
    replay = Replay()
    return replay, [play(path, replay) for path in paths]


def run(capsys, *arguments):
    """A command in this process: exit code, stdout, stderr."""
    capsys.readouterr()
    code = main([*map(str, arguments)])
    out, err = capsys.readouterr()
    return code, out, err


def wait_until(holds):
    deadline = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(LOOK_S)
