"""Scenarios flown as users fly them: daemon and vehicle as processes on UDP, in lockstep, and a ground station."""

import json
import select
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import common as mav

from tests.cli.processes import daemon
from tests.ports import free_port
from tests.sitl.bench import Peer

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Flown:
    """How a flight ended: the vehicle's exit code, its last words, and result.json (None when it was not written)."""

    scenario: str
    delay: int
    code: int
    last_words: str
    result: dict[str, Any] | None

    @property
    def checks(self) -> list[dict[str, Any]]:
        return self.result["checks"] if self.result else []


def fly(
    scenario: str,
    design: Path,
    delay: int,
    out: Path,
    seed: int = 1,
    *,
    vehicle: tuple[str, ...] = (),
    companion: tuple[str, ...] = (),
) -> Flown:
    """Fly one scenario to its end, with these further options of vehicle and companion."""
    port, station = free_port(), Peer(255, 190)
    arguments = [scenario, "--clock", "lockstep", "--seed", str(seed), "--delay", str(delay), "-o", str(out), *vehicle]
    links = ["--link", f"udpout:127.0.0.1:{port}", "--gcs", station.url]
    out.mkdir(parents=True, exist_ok=True)
    words = out / "vehicle.log"
    with daemon(design, port, *companion), words.open("wb") as log, station.socket:
        flying = subprocess.Popen([sys.executable, "-m", "sitl", *arguments, *links], cwd=ROOT, stdout=log, stderr=log)
        try:
            while flying.poll() is None:
                _serve(station)
        finally:
            flying.kill()
            flying.wait()
    lines = words.read_text("utf-8").strip().splitlines()
    result = out / "result.json"
    found = json.loads(result.read_text("utf-8")) if result.exists() else None
    return Flown(scenario, delay, flying.returncode, lines[-1] if lines else "", found)


def _serve(station: Peer) -> None:
    """Switch the observer on when the vehicle asks for it."""
    if not select.select([station.socket], [], [], 0.1)[0]:
        return
    for message in station.receive():
        if message.get_type() == "STATUSTEXT" and message.text == "sitl: waiting for DOB_ENABLE=1":
            station.send(mav.MAVLink_param_set_message(1, 191, b"DOB_ENABLE", 1.0, mav.MAV_PARAM_TYPE_REAL32))
