"""Linear axes as an airframe: the identified ones of the paper, or others."""

from dataclasses import dataclass
from typing import Protocol

from sitl.airframe.condition import Condition
from sitl.airframe.surroundings import Surroundings
from sitl.attitude import LEVEL, ZERO, Quaternion, Vector, down_component, rotated_by_rate
from sitl.constants import DT, GRAVITY

HOVER_THRUST = 0.5
"""Normalized thrust that carries the weight. A guess: a usual thrust-to-weight ratio of two."""

THRUST_LAG = 0.9447
"""Pole of thrust behind its command, per sample: 70 ms. Taken from the pole of Eq. (11), read as rotor lag; a guess."""

VERTICAL_DAMPING = 0.3
"""Climb rate lost to drag, 1/s. A guess; it only shapes take-off."""


@dataclass(frozen=True, slots=True)
class RateAxis:
    """G(z) = gain · (z − zero) / ((z − slow)(z − pole)): normalized torque to body rate, rad/s, at `DT`.

    `slow` is 1 as in the paper where nothing damps the body, and a little less where the air does.
    """

    gain: float
    zero: float
    pole: float
    slow: float = 1.0


PITCH = RateAxis(gain=0.14131, zero=-1.716, pole=0.9447)
"""Paper, Eq. (11)."""

ROLL = RateAxis(gain=-0.0731, zero=2.777, pole=0.9449)
YAW = RateAxis(gain=0.41, zero=0.887, pole=0.9416, slow=0.99836)
"""The tail-sitter's own, from the frequency sweep through MAVLink that gives (11) for pitch (docs/identification.md).

The canted rotors' inertia reacts when they change speed: against roll, which is 3.7 ms later than pitch (its zero has
gone through infinity to the positive axis), and along with yaw, which answers at once. The wing damps yaw.
"""


class LinearAxis:
    """One `RateAxis` as a difference equation in transposed direct form II, the form of `scipy.signal.lfilter`."""

    __slots__ = ("_a1", "_a2", "_b1", "_b2", "_s1", "_s2")

    def __init__(self, axis: RateAxis) -> None:
        self._b1, self._b2 = axis.gain, -axis.gain * axis.zero
        self._a1, self._a2 = -(axis.slow + axis.pole), axis.slow * axis.pole
        self._s1 = self._s2 = 0.0

    @property
    def rate(self) -> float:
        """Body rate now, rad/s: G is strictly proper, so it does not depend on the moment applied now."""
        return self._s1

    def advance(self, moment: float) -> float:
        """Apply `moment` (normalized torque, disturbance included) for one sample; returns the new rate, rad/s."""
        y = self._s1
        self._s1 = self._b1 * moment - self._a1 * y + self._s2
        self._s2 = self._b2 * moment - self._a2 * y
        return self._s1

    def reset(self) -> None:
        """Stand still."""
        self._s1 = self._s2 = 0.0


class RateDynamics(Protocol):
    """What turns normalized torque about roll, pitch, yaw into body rates, rad/s, one sample later."""

    def advance(self, moment: Vector) -> Vector:
        """Apply `moment` (disturbance included) for one sample; returns the new rates."""
        ...

    def reset(self) -> None:
        """Stand still."""
        ...


class UncoupledRates:
    """Three `LinearAxis`, roll, pitch, yaw."""

    __slots__ = ("_pitch", "_roll", "_yaw")

    def __init__(self, axes: tuple[RateAxis, RateAxis, RateAxis]) -> None:
        self._roll, self._pitch, self._yaw = (LinearAxis(a) for a in axes)

    def advance(self, moment: Vector) -> Vector:
        """See `RateDynamics.advance`."""
        return self._roll.advance(moment[0]), self._pitch.advance(moment[1]), self._yaw.advance(moment[2])

    def reset(self) -> None:
        """See `RateDynamics.reset`."""
        for axis in (self._roll, self._pitch, self._yaw):
            axis.reset()


class LinearAirframe:
    """Linear rate dynamics, an exact attitude integration and a vertical axis.

    `axes` are uncoupled ones; `rates` take their place where an aircraft brings dynamics of its own.

    Limits: rates do not couple beyond `rates` (no gyroscopic or inertial terms, as in Section III of the paper), no
    flexible modes and no aerodynamics beyond what these hold; thrust and attitude do not push it sideways, so it stays
    above its take-off point; on the ground it stands upright and feels no disturbance. Of `Condition` it knows the gain
    alone, of `Surroundings` the torque alone. Within a sample the rate changes linearly, so attitude turns by its mean.
    """

    def __init__(
        self, axes: tuple[RateAxis, RateAxis, RateAxis] = (ROLL, PITCH, YAW), *, rates: RateDynamics | None = None
    ) -> None:
        self._rates = rates or UncoupledRates(axes)
        self.rate: Vector = ZERO
        self.attitude: Quaternion = LEVEL
        self.altitude = 0.0
        self.climb = 0.0
        self.on_ground = True
        self.specific_force: Vector = (0.0, 0.0, -GRAVITY)
        self.condition = Condition()
        self._lift = 0.0  # lagged thrust

    @property
    def position(self) -> Vector:
        """North-east-down from the take-off point, m."""
        return (0.0, 0.0, -self.altitude)

    @property
    def velocity(self) -> Vector:
        """North-east-down, m/s."""
        return (0.0, 0.0, -self.climb)

    def advance(self, torque: Vector, thrust: float, around: Surroundings) -> None:
        """Fly one sample; see `Airframe.advance`."""
        self._advance_vertical(thrust)
        if self.on_ground:
            return
        p, q, r = self.rate
        d, gain = around.torque, self.condition.gain
        moment = (gain[0] * (torque[0] + d[0]), gain[1] * (torque[1] + d[1]), gain[2] * (torque[2] + d[2]))
        rate = self._rates.advance(moment)
        mean = (0.5 * (p + rate[0]), 0.5 * (q + rate[1]), 0.5 * (r + rate[2]))
        self.attitude = rotated_by_rate(self.attitude, mean, DT)
        self.rate = rate

    def _advance_vertical(self, thrust: float) -> None:
        self._lift = THRUST_LAG * self._lift + (1.0 - THRUST_LAG) * thrust
        push = GRAVITY * self._lift / HOVER_THRUST
        acceleration = push * down_component(self.attitude) - GRAVITY - VERTICAL_DAMPING * self.climb
        if self.on_ground and acceleration <= 0.0:
            return
        self.on_ground = False
        self.climb += acceleration * DT
        self.altitude += self.climb * DT
        self.specific_force = (0.0, 0.0, -push)
        if self.altitude <= 0.0:
            self._touch_down()

    def _touch_down(self) -> None:
        self.altitude, self.climb, self.on_ground = 0.0, 0.0, True
        self.rate, self.attitude, self.specific_force = ZERO, LEVEL, (0.0, 0.0, -GRAVITY)
        self._rates.reset()
