"""One flight of a campaign: flown to its end in this process, and its row of numbers. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from dob_companion.artifact import DobDesign, loads
from sitl.airframe.linear import PITCH, ROLL, YAW, LinearAirframe, RateAxis
from sitl.attitude import Vector
from sitl.autopilot.aircraft import Aircraft, linear, tailsitter
from sitl.autopilot.vehicle import START_US
from sitl.campaign.onboard import Onboard
from sitl.campaign.plan import Inputs
from sitl.constants import AXES, DT
from sitl.errors import FlightFailedError, SitlError
from sitl.flight import Flight
from sitl.log import ON_WINDOW
from sitl.result import summarize
from sitl.scenario.checks import judge
from sitl.scenario.script import Phase
from sitl.scenario.spec import Scenario
from sitl.tailsitter.parameters import Parameters
from sitl.weather.gusts import Wind

PATIENCE_S = 60.0
"""Vehicle time after which a flight that does not reach its hover is given up."""

_LATE_US = START_US + round(1e6 * PATIENCE_S)

SPAN_M = 0.9
"""Wing span that filters the air's rotation where the scenario names none, m: the simulated tail-sitter's."""

CALM_M_S = 0.5
"""Turbulence is carried past the vehicle by the mean wind: below this there is none."""

Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Job:
    """What one flight needs, wherever it is flown: small, and the same job gives the same row.

    `scale` is the disturbance's size, roll pitch yaw (see `calibration`); `design` the text of a design.json.
    """

    inputs: Inputs
    scenario: Scenario
    scale: Vector
    design: str
    parameters: Mapping[str, float]


class Craft:
    """A vehicle with its companion on board, flown sample by sample.

    `failure` says why it did not reach its end, "" when nothing is wrong.
    """

    def __init__(self, job: Job) -> None:
        inputs = job.inputs
        self.flight = Flight(
            scenario_of(job.scenario, inputs),
            inputs.seed,
            job.scale,
            aircraft=aircraft_of(inputs),
            delay_samples=max(inputs.delay, 1),
        )
        self.onboard = Onboard(_design(job.design), job.parameters, self.flight, prompt=inputs.delay == 0)
        self.failure = ""

    def step(self) -> None:
        """Fly the next sample; the observer is switched on where the script asks for it. Raises FlightFailedError."""
        script = self.flight.script
        sample, _ = self.flight.step()
        self.onboard.sample(sample)
        if script.phase is Phase.WAIT_OBSERVER:
            self.onboard.write("DOB_ENABLE", 1.0)
            script.observer_reported(True)
        elif script.phase is Phase.CLIMB and sample.stamp_us > _LATE_US:
            raise FlightFailedError(f"hover was not reached within {PATIENCE_S:g} s")


def fly(job: Job) -> Craft:
    """Fly a job to its end. A vehicle that comes down, or numbers that run away, are a failure and not an error."""
    craft = Craft(job)
    try:
        while not craft.flight.complete:
            craft.step()
    except (SitlError, ArithmeticError, ValueError) as error:
        craft.failure = str(error) or type(error).__name__
    return craft


def scenario_of(scenario: Scenario, inputs: Inputs) -> Scenario:
    """The scenario in this flight's wind: the mean, and turbulence as strong as the standard has it for such a wind."""
    mean = inputs.wind_m_s
    if mean is None:
        return scenario
    own = scenario.wind or Wind(0.0, 0.0, 0.0, SPAN_M)
    wind = replace(own, mean=mean, turbulence=mean if mean >= CALM_M_S else 0.0)
    return replace(scenario, airframe=inputs.airframe, wind=wind)


def aircraft_of(inputs: Inputs) -> Aircraft:
    """The aircraft with this flight's plant errors."""
    aircraft = _tailsitter(inputs.pole) if inputs.airframe == "tailsitter" else _linear(inputs.pole)
    aircraft.airframe.condition.gain = (inputs.gain, inputs.gain, inputs.gain)
    return aircraft


def _tailsitter(pole: float) -> Aircraft:
    nominal = Parameters()
    return tailsitter(replace(nominal, rotor_lag=nominal.rotor_lag / pole))


def _linear(pole: float) -> Aircraft:
    roll, pitch, yaw = (_with_lag(axis, pole) for axis in (ROLL, PITCH, YAW))
    return linear(LinearAirframe((roll, pitch, yaw)))


def _with_lag(axis: RateAxis, factor: float) -> RateAxis:
    """Corner frequency of the lag times `factor`; the acceleration that a steady torque comes to stays the same."""
    if factor == 1.0:
        return axis
    pole = axis.pole**factor
    return replace(axis, gain=axis.gain * (1.0 - pole) / (1.0 - axis.pole), pole=pole)


@lru_cache(maxsize=64)
def _design(text: str) -> DobDesign:
    return loads(text)


def row_of(job: Job, craft: Craft) -> Row:
    """The numbers of one flight, the same for the same job; None where there is no number.

    Errors in rad, corrections in normalized torque; `injecting` is the share of the window on with a correction.
    """
    row: Row = {
        **job.inputs._asdict(),
        "outcome": "failed" if craft.failure else "complete",
        "reason": craft.failure or craft.onboard.why,
        "state": craft.onboard.state.name,
        "flown_s": 1e-6 * (craft.flight.vehicle.now_us - START_US) + DT,
    }
    if craft.failure:
        return row
    arrays = craft.flight.log.arrays()
    result = summarize(job.scenario, job.inputs.seed, "in-process", arrays)
    correction = np.abs(arrays["correction"][arrays["window"] == ON_WINDOW].astype(float))
    row |= {"delay_samples": result["delay_samples"], "injecting": float(np.any(correction > 0.0, axis=1).mean())}
    found = judge(job.scenario.checks, arrays, craft.flight.delay_samples)
    missed = [verdict.name for verdict in found if not verdict.passed]
    row |= {"checks": len(found), "checks_missed": len(missed), "missed": "; ".join(missed)}
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
