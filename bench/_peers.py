"""Processes that answer a datagram on loopback: the daemon, bare echoes in C and Python, MAVSDK; and what they use."""

import contextlib
import os
import shutil
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pymavlink.dialects.v20 import common as mav

from dob_companion.artifact import DobDesign, dumps
from dob_companion.demo.processes import free_udp_ports
from dob_companion.synthesis import design_from_toml

HERE = Path(__file__).parent
SPEC = HERE.parent / "examples" / "tailsitter_paper.toml"
PATIENCE_S = 30.0
ANSWER_BYTES = 12 + 30
"""A DEBUG_VECT on the wire: header and checksum, and the payload."""

HEARTBEAT = mav.MAVLink_heartbeat_message(2, 12, 128, 0, 4, 3)


def paper_design() -> DobDesign:
    return design_from_toml(SPEC.read_text(encoding="utf-8"), str(SPEC), "2026-01-01T00:00:00Z")


@dataclass
class Peer:
    """One answering process, seen from the vehicle's end of a socket of its own."""

    process: subprocess.Popen[str]
    port: int
    out: mav.MAVLink = field(default_factory=lambda: mav.MAVLink(None, srcSystem=1, srcComponent=1))

    def __post_init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        # by the kernel and not by settimeout(), which would poll before each call
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, struct.pack("ll", 2, 0))
        self.socket.connect(("127.0.0.1", self.port))

    def send(self, message: mav.MAVLink_message) -> None:
        self.socket.send(bytes(message.pack(self.out)))

    def drain(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                self.socket.recv(2048, socket.MSG_DONTWAIT)

    def ask(self, question: bytes, stamp: int) -> float:
        """Microseconds from sending `question` until its DEBUG_VECT is here."""
        begin = time.perf_counter_ns()
        self.socket.send(question)
        while True:
            answer = self.socket.recv(2048)
            if answer[7:10] == b"\xfa\0\0" and int.from_bytes(answer[10:18], "little") == stamp:
                return (time.perf_counter_ns() - begin) * 1e-3

    def echo(self, question: bytes) -> float:
        """Microseconds until anything is here."""
        begin = time.perf_counter_ns()
        self.socket.send(question)
        self.socket.recv(2048)
        return (time.perf_counter_ns() - begin) * 1e-3

    def cpu_s(self) -> float:
        """Processor time used so far, by all threads."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def memory_kib(self) -> int:
        """Resident memory."""
        pages = Path(f"/proc/{self.process.pid}/statm").read_text(encoding="ascii").split()[1]
        return int(pages) * os.sysconf("SC_PAGE_SIZE") // 1024

    def scheduling(self) -> str:
        return {os.SCHED_OTHER: "ordinary", os.SCHED_FIFO: "SCHED_FIFO"}.get(
            os.sched_getscheduler(self.process.pid), "other"
        )

    def schedule_like(self, other: "Peer") -> None:
        """What the daemon got, its rivals get too."""
        pid = other.process.pid
        os.sched_setscheduler(self.process.pid, os.sched_getscheduler(pid), os.sched_getparam(pid))


def imu(stamp: int, rates: np.ndarray) -> mav.MAVLink_message:
    return mav.MAVLink_highres_imu_message(stamp, 0, 0, 0, *rates, 0, 0, 0, 0, 0, 0, 0, 56)


def target(stamp: int) -> mav.MAVLink_message:
    return mav.MAVLink_actuator_control_target_message(stamp, 0, [0, 0, 0, 0.5, 0, 0, 0, 1])


@contextlib.contextmanager
def companion(directory: Path, design: DobDesign, program: Sequence[str] = ("-m", "dob_companion")) -> Iterator[Peer]:
    """`dob-companion run`, the real program, as Python is told to start it."""
    path, port = directory / "design.json", free_port()
    path.write_text(dumps(design)[0], encoding="utf-8")
    command = [sys.executable, *program, "run", "--design", str(path), "--link", f"udpin:127.0.0.1:{port}"]
    with _running(command, lambda process: _line_with(process.stderr, "listening") and port) as peer:
        yield peer


@contextlib.contextmanager
def c_echo(directory: Path) -> Iterator[Peer | None]:
    """bench/echo.c; None where there is no C compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        yield None
        return
    program = directory / "echo"
    subprocess.run([compiler, "-O2", "-o", str(program), str(HERE / "echo.c")], check=True)
    with _running([str(program), str(ANSWER_BYTES)], lambda process: int(process.stdout.readline())) as peer:
        yield peer


@contextlib.contextmanager
def python_echo() -> Iterator[Peer]:
    """bench/_echo.py."""
    command = [sys.executable, "-m", "bench._echo", str(ANSWER_BYTES)]
    with _running(command, lambda process: int(process.stdout.readline())) as peer:
        yield peer


@contextlib.contextmanager
def mavsdk() -> Iterator[Peer]:
    """MAVSDK's raw-message path, subscribe to send (_mavsdk_answer.py)."""
    port = free_port()
    command = [sys.executable, "-m", "bench._mavsdk_answer", str(port)]
    with _running(command, lambda process: _line_with(process.stdout, "listening") and port) as peer:
        peer.send(HEARTBEAT)
        _line_with(peer.process.stdout, "ready")
        yield peer


@contextlib.contextmanager
def _running(command: list[str], port_of: Callable[[subprocess.Popen[str]], int]) -> Iterator[Peer]:
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=HERE.parent)
    try:
        peer = Peer(process, port_of(process))
        yield peer
        peer.socket.close()
    finally:
        process.kill()
        process.communicate()


def _line_with(stream: object, word: str) -> str:
    for line in stream:  # type: ignore[attr-defined]
        if word in line:
            return str(line)
    raise RuntimeError(f"a process ended before it said {word!r}")


def free_port() -> int:
    return free_udp_ports(1)[0]
