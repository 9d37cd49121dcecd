"""One sample of the simulated vehicle: sensors, control, mixer and airframe, without companion or link.

The reference is the vehicle with the linear axes, whose airframe costs next to nothing: the rest is the tail-sitter.
"""

import time
from collections.abc import Iterator

import numpy as np

from sitl.airframe.surroundings import Surroundings
from sitl.attitude import ZERO
from sitl.autopilot.aircraft import Aircraft, linear, tailsitter
from sitl.autopilot.correction import CorrectionInput
from sitl.autopilot.vehicle import Vehicle
from sitl.constants import DT

BLOCK = 250
BLOCKS = 60
AROUND = Surroundings(torque=(0.01, 0.02, -0.01), wind=(3.0, 1.0, 0.0), wind_rate=(0.01, 0.0, 0.0), wall_m=2.0)


def measure() -> Iterator[str]:
    """Time of a sample in blocks of a second, the airframes in turn; speed over real time from the median."""
    bare, loaded = tailsitter(), tailsitter()
    loaded.airframe.condition.flexible = loaded.airframe.condition.battery_sag = True
    vehicles = {
        "linear axes": _hovering(linear()),
        "tail-sitter": _hovering(bare),
        "with modes and battery": _hovering(loaded),
    }
    times = {name: np.empty(BLOCKS) for name in vehicles}
    for k in range(BLOCKS):
        for name, vehicle in vehicles.items():
            times[name][k] = _block(vehicle)
    yield f"{'µs a sample':26}{'least':>8}{'median':>8}{'real time ×':>13}"
    for name, taken in times.items():
        median = float(np.median(taken))
        yield f"{name:26}{taken.min() * 1e6:>8.1f}{median * 1e6:>8.1f}{DT / median:>13.0f}"
    ratio = np.median(times["tail-sitter"]) / np.median(times["linear axes"])
    yield f"{'tail-sitter over linear':26}{'':>8}{ratio:>8.2f}"


def _hovering(aircraft: Aircraft) -> Vehicle:
    vehicle = Vehicle(aircraft)
    vehicle.arm()
    vehicle.take_off(5.0)
    for _ in range(8):
        _block(vehicle)
    return vehicle


def _block(vehicle: Vehicle) -> float:
    """Seconds per sample, mean of a block."""
    corrections = CorrectionInput()
    start = time.perf_counter()
    for _ in range(BLOCK):
        vehicle.step(AROUND, ZERO, corrections)
    return (time.perf_counter() - start) / BLOCK
