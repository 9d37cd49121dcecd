"""An aircraft ready to fly: an airframe with the mixer and the gains that fit it."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sitl.airframe.linear import HOVER_THRUST, LinearAirframe
from sitl.airframe.mixer import Allocator, SeparateAxes
from sitl.airframe.protocol import Airframe
from sitl.attitude import Vector
from sitl.autopilot.controller import ATTITUDE_GAIN, RateLaw
from sitl.autopilot.tuning import RATE_PIDS, Tuning

if TYPE_CHECKING:
    from sitl.tailsitter.parameters import Parameters

LINEAR_TUNING = Tuning(rate=RATE_PIDS, hover_thrust=HOVER_THRUST)

ALTITUDE_INTEGRAL = 0.8
"""Acceleration gained per climb rate error and time, 1/s². A guess; PX4's MPC_Z_VEL_I_ACC is 2."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Aircraft:
    """What a `Vehicle` flies, how it flies it, and how its torque and thrust reach the rotors.

    `rates` take the place of the tuning's PIDs; `attitude_gain` is the rate asked for per attitude error about roll,
    pitch, yaw, 1/s.
    """

    airframe: Airframe
    mixer: Allocator
    tuning: Tuning
    rates: RateLaw | None = None
    attitude_gain: Vector = (ATTITUDE_GAIN, ATTITUDE_GAIN, ATTITUDE_GAIN)


def linear(airframe: LinearAirframe | None = None) -> Aircraft:
    """The linear axes of the paper, or such axes with other numbers, under the paper's gains."""
    return Aircraft(airframe=airframe or LinearAirframe(), mixer=SeparateAxes(), tuning=LINEAR_TUNING)


def tailsitter(parameters: "Parameters | None" = None) -> Aircraft:
    """The nonlinear tail-sitter on the ground; its hover thrust is that of its trim."""
    from sitl.tailsitter.airframe import Tailsitter, rotor_mixer  # compiled when it is first wanted
    from sitl.tailsitter.parameters import Parameters
    from sitl.tailsitter.trim import trim

    p = parameters or Parameters()
    tuning = Tuning(RATE_PIDS, trim(p).thrust, ALTITUDE_INTEGRAL, position_hold=True)
    return Aircraft(airframe=Tailsitter(p), mixer=rotor_mixer(p), tuning=tuning)


def aircraft_named(name: str) -> Aircraft:
    """A new aircraft of this kind (`scenario.spec.AIRFRAMES`), on the ground."""
    return tailsitter() if name == "tailsitter" else linear()
