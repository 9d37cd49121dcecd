"""The sweep's clock and sockets: a simulated vehicle as a process of its own, and the client on its companion link."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic

from sitl.errors import FlightFailedError
from sitl.links import Link, UdpLink, open_link, wait
from sitl.sweep.client import SweepClient

SILENCE_S = 120.0
"""Wall time without a byte from the vehicle that ends the sweep: the tail-sitter is compiled when it first flies."""

HOST = "127.0.0.1"

Ended = Callable[[], int | None]
"""The vehicle's exit code, None while it runs."""


@contextmanager
def started_vehicle(scenario: Path, seed: int) -> Iterator[tuple[Link, Ended]]:
    """A vehicle that flies `scenario` in lockstep and waits for commands: its companion link, and whether it ended.

    The ports are free ones. Its ground station's link leads to a port that nobody reads.
    """
    with _free_port() as companion, _free_port() as ground:
        arguments = ("--clock", "lockstep", "--await-arming", "--seed", str(seed), "--timeout", f"{SILENCE_S:g}")
        links = ("--link", f"udpout:{HOST}:{_port(companion)}", "--gcs", f"udpout:{HOST}:{_port(ground)}")
        command = [sys.executable, "-m", "sitl", str(scenario), *arguments, *links]
        with subprocess.Popen(command) as process:
            try:
                yield companion, process.poll
            finally:
                process.terminate()


@contextmanager
def given_link(url: str) -> Iterator[tuple[Link, Ended]]:
    """The link `url`, on which a vehicle waits; when that ends is not known. Raises LinkUrlError and LinkBusyError."""
    link = open_link(url)
    try:
        yield link, lambda: None
    finally:
        link.close()


@contextmanager
def _free_port() -> Iterator[UdpLink]:
    link = UdpLink(f"udpin:{HOST}:0", True, HOST, 0)
    try:
        yield link
    finally:
        link.close()


def _port(link: UdpLink) -> int:
    return int(link.sockets()[0].getsockname()[1])


def sweep(client: SweepClient, link: Link, ended: Ended) -> None:
    """Serve `link` until the client is done. FlightFailedError when the vehicle ends or is silent before that."""
    heard = monotonic()
    phase = client.phase
    while not client.done:
        for _, data in wait({"companion": link}, 1.0):
            heard = monotonic()
            client.receive(data)
        if answer := client.bytes_to_send():
            link.send(answer)
        if client.phase is not phase:
            phase = client.phase
            print(f"sweep: {phase.value}", file=sys.stderr, flush=True)
        if (code := ended()) is not None:
            raise FlightFailedError(f"the vehicle ended with exit code {code}; expected it to fly to the end")
        if monotonic() - heard > SILENCE_S:
            raise FlightFailedError(f"no byte from the vehicle for {SILENCE_S:g} s; expected its companion link here")
