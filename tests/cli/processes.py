"""The real program as a process, and a vehicle's end of a UDP link to talk to it."""

import contextlib
import io
import os
import select
import socket
import subprocess
import sys
import time

from pymavlink.dialects.v20 import common as mav

from dob_companion.cli.main import main

PATIENCE_S = 120.0
"""What hangs is given up after so long. Whatever is waited for is an event: how long it takes proves nothing."""


def run_cli(*arguments, timeout=PATIENCE_S, cwd=None):
    """Run dob-companion to its end."""
    return subprocess.run(
        [sys.executable, "-m", "dob_companion", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=timeout,
        cwd=cwd,
        check=False,
    )


def run_here(*arguments):
    """The same within this process, for what ends before it has begun anything: no interpreter to start."""
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
        try:
            code = main([*map(str, arguments)])
        except SystemExit as left:
            code = left.code
    return subprocess.CompletedProcess(arguments, code, out.getvalue(), err.getvalue())


def one_line(finished):
    """The complaint on stderr, which must be a single line."""
    lines = finished.stderr.strip().splitlines()
    assert len(lines) == 1, finished.stderr
    return lines[0]


@contextlib.contextmanager
def daemon(design, port, *more):
    """`dob-companion run` listening on a port; killed at the end if it has not left by itself."""
    process = subprocess.Popen(
        [sys.executable, "-m", "dob_companion", "run", "--design", design, "--link", f"udpin:127.0.0.1:{port}", *more],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )
    try:
        wait_for(process.stderr, "listening")
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def wait_for(stream, word):
    """Read lines until one holds the word."""
    seen = []
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        line = stream.readline()
        seen.append(line)
        if word in line:
            return line
        if not line:
            break
    raise AssertionError(f"{word!r} not seen in {seen}")


class UdpVehicle:
    """Sends pairs to a companion on a real socket and waits for the answer to each, as in lockstep."""

    def __init__(self, port):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(("127.0.0.1", port))
        self.out = mav.MAVLink(None, srcSystem=1, srcComponent=1)
        self.ground = mav.MAVLink(None, srcSystem=255, srcComponent=190)
        self.ear = mav.MAVLink(None)
        self.ear.robust_parsing = True
        self.sample = 0
        self.said = []

    def __enter__(self):
        self.beat()
        return self

    def beat(self):
        self.send(mav.MAVLink_heartbeat_message(2, mav.MAV_AUTOPILOT_GENERIC, 128, 0, 4, 3))

    def meet(self):
        """Wait for a companion whose log does not tell when it listens."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            with contextlib.suppress(ConnectionRefusedError):
                self.beat()
                if self.hear(0.1):
                    return
        raise AssertionError("no companion was met")

    def __exit__(self, *_):
        self.socket.close()

    def send(self, message, by=None):
        self.socket.send(bytes(message.pack(by or self.out)))

    def hear(self, timeout=0.0):
        """Messages that have come within the time."""
        if not select.select([self.socket], [], [], timeout)[0]:
            return []
        try:
            heard = self.ear.parse_buffer(self.receive()) or []
        except ConnectionRefusedError:
            return []
        self.said += heard
        return heard

    def receive(self):
        """The next datagram."""
        return self.socket.recv(4096)

    @property
    def stamp(self):
        """Of the next sample."""
        return 1_000_000 + 4000 * self.sample

    def fly(self, count, rates=(0.2, 0.0, 0.0), wait=True):
        """`count` samples, each answered before the next unless told not to wait; returns the corrections."""
        answers = []
        for _ in range(count):
            if self.sample % 250 == 0:
                self.beat()
            stamp = self.stamp
            self.send(mav.MAVLink_highres_imu_message(stamp, 0, 0, 0, *rates, 0, 0, 0, 0, 0, 0, 0, 56))
            self.send(mav.MAVLink_actuator_control_target_message(stamp, 0, [0, 0, 0, 0.5, 0, 0, 0, 1]))
            if wait:
                answers.append(self.wait(lambda m, t=stamp: m.get_type() == "DEBUG_VECT" and m.time_usec == t))
            self.sample += 1
        return answers

    def wait(self, fits):
        """The next message that fits."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            for message in self.hear(0.1):
                if fits(message):
                    return message
        raise AssertionError("the companion did not say what was waited for")

    def write(self, name, value):
        self.send(mav.MAVLink_param_set_message(1, 191, name.encode(), value, 9), by=self.ground)
        return self.wait(lambda m: m.get_type() == "PARAM_VALUE" and m.param_id == name)

    def activate(self):
        """Fly until the correction is fully in, past the step that the first enabling in a flight makes."""
        self.fly(600)
        self.write("DOB_ENABLE", 1.0)
        self.fly(600)
        return self

    def last_correction(self, process):
        """Whatever comes until the process has gone; the last correction among it."""
        deadline = time.monotonic() + PATIENCE_S
        while process.poll() is None:
            assert time.monotonic() < deadline, "the companion did not end"
            self.hear(0.05)
        while self.hear(0.05):
            pass
        return [m for m in self.said if m.get_type() == "DEBUG_VECT"][-1]
