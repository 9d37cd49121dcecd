"""What surrounds the vehicle during one sample: the disturbance, the air, and what it is near."""

from math import inf
from typing import NamedTuple

from sitl.attitude import ZERO, Vector


class Surroundings(NamedTuple):
    """Held for one sample.

    `torque` is the paper's d, normalized torque at the input of G, roll, pitch, yaw in hover axes. `wind` is the
    velocity of the air at the vehicle, m/s, north-east-down, gusts included; `wind_rate` the rotation of that air,
    rad/s, hover axes. `moment` is an external moment on the body, Nm, hover axes. `wall_m` is the distance from the
    body's centre to a vertical wall to the north, m.
    """

    torque: Vector = ZERO
    wind: Vector = ZERO
    wind_rate: Vector = ZERO
    moment: Vector = ZERO
    wall_m: float = inf


STILL = Surroundings()
