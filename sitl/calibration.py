"""How strong must the disturbance be? Fly the window with the observer off until its peaks are the scenario's."""

from collections.abc import Callable

import numpy as np

from sitl.attitude import Vector
from sitl.autopilot.aircraft import Aircraft
from sitl.errors import FlightFailedError
from sitl.flight import Flight
from sitl.log import OFF_WINDOW
from sitl.scenario.script import Phase
from sitl.scenario.spec import Scenario

TOLERANCE = 1e-6
"""Relative error of the peaks at which the search ends."""

MAX_FLIGHTS = 30

Builder = Callable[[], Aircraft]
"""Makes a new aircraft for each flight."""


def peaks_off(scenario: Scenario, seed: int, scale: Vector, build: Builder | None = None) -> Vector:
    """Peak attitude error of each axis, rad, mean removed, in the window flown without any companion."""
    flight = Flight(scenario, seed, scale, aircraft=build() if build else None)
    while flight.script.phase is not Phase.WAIT_OBSERVER:
        flight.step()
    arrays = flight.log.arrays()
    error = arrays["attitude_error"][arrays["window"] == OFF_WINDOW].astype(float)
    roll, pitch, yaw = np.abs(error - error.mean(axis=0)).max(axis=0).tolist()
    return roll, pitch, yaw


def disturbance_scale(scenario: Scenario, seed: int, build: Builder | None = None) -> Vector:
    """Size of the disturbance per axis that gives the scenario's error peaks: see `Flight`.

    `build` makes the aircraft, by default the scenario's own. Beyond the disturbance's `largest` it is not made
    stronger, however small the peaks are then.

    Fixed-point iteration over whole flights of the vehicle itself, each axis scaled by wanted over found, with smaller
    steps when that leads astray: a linear vehicle takes a handful of flights, axes that share rotors some more. Raises
    FlightFailedError when it does not settle, comes down (peaks beyond what the torque limits allow), or has no body
    for the disturbance to act on.
    """
    if scenario.disturbance is None:
        return (0.0, 0.0, 0.0)
    if scenario.lacks_body:
        raise FlightFailedError(f"{scenario.name}: its disturbance is a moment on the body, which linear axes lack")
    wanted = np.array(scenario.disturbance.peak_attitude_error)
    disturbed, largest = wanted > 0.0, scenario.disturbance.largest
    scale = np.where(disturbed, min(0.05, largest), 0.0)  # within reach: a twentieth of full torque, or of a Nm
    step, before = 1.0, np.inf
    for _ in range(MAX_FLIGHTS):
        try:
            found = np.array(peaks_off(scenario, seed, (scale[0], scale[1], scale[2]), build))
        except FlightFailedError:  # it came down
            break
        share = wanted[disturbed] / found[disturbed]
        held = (scale[disturbed] >= largest) & (share > 1.0)  # as strong as it may be
        astray = float(np.abs(np.log(np.where(held, 1.0, share))).max())
        if astray < TOLERANCE:
            return float(scale[0]), float(scale[1]), float(scale[2])
        if astray > 0.7 * before:
            step *= 0.7
        before = astray
        scale[disturbed] = np.minimum(scale[disturbed] * share**step, largest)
    raise FlightFailedError(f"no disturbance gives error peaks of {wanted.tolist()} rad; expected smaller ones")
