"""One flight of a campaign: flown to its end in this process, and its row of numbers. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from dob_companion.artifact import DobDesign, loads
from sitl.attitude import Vector
from sitl.campaign.onboard import Onboard
from sitl.campaign.plan import Inputs
from sitl.dynamics import DT, PITCH, ROLL, YAW, Airframe, LinearAirframe, RateAxis
from sitl.errors import FlightFailedError, SitlError
from sitl.flight import Flight
from sitl.result import summarize
from sitl.scenario import AXES, Scenario
from sitl.script import ON_WINDOW, Phase
from sitl.vehicle import START_US

PATIENCE_S = 60.0
"""Vehicle time after which a flight that does not reach its hover is given up."""

Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Job:
    """What one flight needs, wherever it is flown: small, and the same number gives the same row.

    `scale` is the disturbance's standard deviation, normalized torque, roll pitch yaw (see `sitl.calibration`);
    `design` the text of a design.json.
    """

    inputs: Inputs
    scenario: Scenario
    scale: Vector
    design: str
    parameters: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Flown:
    """A flight that has ended; `failure` says why it did not reach its end, "" when it did."""

    flight: Flight
    onboard: Onboard
    failure: str


def fly(job: Job) -> Flown:
    """Fly a job to its end. A vehicle that comes down or numbers that run away are a failure, not an error."""
    flight = Flight(job.scenario, job.inputs.seed, job.scale, airframe=airframe_of(job.inputs))
    onboard = Onboard(_design(job.design), job.parameters, job.inputs.delay)
    try:
        _to_the_end(flight, onboard)
    except (SitlError, ArithmeticError, ValueError) as error:
        return Flown(flight, onboard, str(error) or type(error).__name__)
    return Flown(flight, onboard, "")


def _to_the_end(flight: Flight, onboard: Onboard) -> None:
    script, late_us = flight.script, START_US + round(1e6 * PATIENCE_S)
    while not flight.complete:
        sample, _ = flight.step()
        onboard.sample(flight, sample)
        if script.phase is Phase.WAIT_OBSERVER:
            onboard.write("DOB_ENABLE", 1.0)
            script.observer_reported(True)
        if script.phase is Phase.CLIMB and sample.stamp_us > late_us:
            raise FlightFailedError(f"hover was not reached within {PATIENCE_S:g} s")


def airframe_of(inputs: Inputs) -> Airframe:
    """The airframe with this flight's plant errors."""
    roll, pitch, yaw = (_with_lag(axis, inputs.pole) for axis in (ROLL, PITCH, YAW))
    airframe = LinearAirframe((roll, pitch, yaw))
    airframe.condition.gain = (inputs.gain, inputs.gain, inputs.gain)
    return airframe


def _with_lag(axis: RateAxis, factor: float) -> RateAxis:
    """Corner frequency of the lag times `factor`; what a steady torque comes to in the end stays the same."""
    if factor == 1.0:
        return axis
    pole = axis.pole**factor
    return RateAxis(axis.gain * (1.0 - pole) / (1.0 - axis.pole), axis.zero, pole)


@lru_cache(maxsize=64)
def _design(text: str) -> DobDesign:
    return loads(text)


def row_of(job: Job, flown: Flown) -> Row:
    """The numbers of one flight, the same for the same job; None where there is no number.

    Errors in rad, corrections in normalized torque; `injecting` is the share of the window on with a correction.
    """
    row: Row = {
        **job.inputs._asdict(),
        "outcome": "failed" if flown.failure else "complete",
        "reason": flown.failure or flown.onboard.why,
        "state": flown.onboard.state.name,
        "flown_s": 1e-6 * (flown.flight.vehicle.now_us - START_US) + DT,
    }
    if flown.failure:
        return row
    arrays = flown.flight.log.arrays()
    result = summarize(job.scenario, job.inputs.seed, "in-process", arrays)
    window_on = arrays["window"] == ON_WINDOW
    correction = np.abs(arrays["correction"][window_on].astype(float))
    row |= {"delay_samples": result["delay_samples"], "injecting": float(np.any(correction > 0.0, axis=1).mean())}
    for i, axis in enumerate(AXES):
        numbers = result["axes"][axis]
        row |= {f"{name}_{axis}": numbers[name] for name in MEASURES}
        row[f"max_correction_{axis}"] = float(correction[:, i].max())
    return row


MEASURES = ("peak_off", "peak_on", "rms_off", "rms_on", "peak_ratio", "rms_ratio")
"""Of each axis, as in `result.json`."""


def fly_row(job: Job) -> Row:
    """Fly a job and keep its row alone: what a worker does."""
    return row_of(job, fly(job))
