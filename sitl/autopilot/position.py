"""Position hold: from where it is to how it should lean, and from how high it is to how much thrust."""

from math import exp, hypot

from sitl.attitude import LEVEL, ZERO, Quaternion, Vector, attitude_error, lean
from sitl.autopilot.tuning import Tuning
from sitl.constants import DT, GRAVITY

EVERY = 5
"""Samples per step of the position loop: 50 Hz, as in common autopilots."""

POSITION_GAIN, VELOCITY_GAIN, INTEGRAL_GAIN = 0.95, 1.8, 0.4
"""Velocity asked for per position error, 1/s; acceleration per velocity error, 1/s, and per its integral, 1/s². PX4's
defaults (MPC_XY_P, MPC_XY_VEL_P_ACC, MPC_XY_VEL_I_ACC)."""

MAX_SPEED = 3.0
"""Speed asked for, m/s. A guess: a hover, not a journey."""

MAX_LEAN = 1.0
"""Tangent of the largest lean asked for: 45°, PX4's MPC_TILTMAX_AIR. With the wing broadside a lean is also an angle of
attack; it holds the tail-sitter in 8 m/s."""

SHAPING_S = 0.08
"""Each of the two lags in series that shape the lean, s. Together they delay it by 0.16 s: what the attitude loop's own
lag, 1 / ATTITUDE_GAIN, was before the lean's rate was fed forward, so that the position loop sees the same delay."""

_SHARE = 1.0 - exp(-DT / SHAPING_S)

ALTITUDE_GAIN = 1.0
"""Climb rate asked for per altitude error, 1/s. A guess: slower than the thrust lag by an order of magnitude."""

CLIMB_GAIN = 2.5
"""Acceleration asked for per climb rate error, 1/s. A guess, with 70 ms of thrust lag well damped."""

MAX_CLIMB, MAX_SINK, LANDING_SINK = 2.0, 1.0, 0.5
"""Climb rate limits, m/s. Guesses, usual for take-off and landing."""

MAX_TRIM = GRAVITY
"""Largest acceleration that either integral may hold, m/s². A guess."""


class PositionHold:
    """Holds the point (north, east) where it was last reset; returns the lean that brings it back there.

    Cascade: position error to velocity (limited), velocity error to acceleration with an integral (the steady wind),
    acceleration to the direction of thrust.

    With `feed_forward` the acceleration passes two equal first-order lags at the full rate, so that the lean turns
    smoothly, and `rate` is the rate, rad/s in leaning axes, at which it turns: what ArduPilot's input shaping does
    with ATC_RATE_FF_ENAB. Without it the lean comes in steps and `rate` stays 0.
    """

    def __init__(self) -> None:
        self.feed_forward = False
        self.reset(0.0, 0.0)

    def reset(self, north: float, east: float) -> None:
        """Hold this point from now on, m; forget the wind."""
        self.point = (north, east)
        self._trim = self._asked = self._between = self._shaped = (0.0, 0.0)
        self._lean: Quaternion = LEVEL
        self.rate: Vector = ZERO
        self._wait = 0

    def step(self, position: Vector, velocity: Vector) -> Quaternion:
        """Rotation that leans thrust the right way, for one sample; `position` and `velocity` north-east-down."""
        if self._wait == 0:
            self._wait = EVERY
            self._asked = self._update(position, velocity)
            if not self.feed_forward:
                self._between = self._shaped = self._asked
                self._lean, self.rate = lean(*self._asked), ZERO
        self._wait -= 1
        if self.feed_forward:
            self._shape()
        return self._lean

    def _shape(self) -> None:
        """Turn the lean on by one sample."""
        self._between = _nearer(self._between, self._asked)
        self._shaped = _nearer(self._shaped, self._between)
        before, self._lean = self._lean, lean(*self._shaped)
        x, y, z = attitude_error(before, self._lean)
        self.rate = (x / DT, y / DT, z / DT)

    def _update(self, position: Vector, velocity: Vector) -> tuple[float, float]:
        """Horizontal acceleration asked for, north and east, m/s²."""
        vn = POSITION_GAIN * (self.point[0] - position[0])
        ve = POSITION_GAIN * (self.point[1] - position[1])
        k = min(1.0, MAX_SPEED / max(hypot(vn, ve), 1e-9))
        en, ee = k * vn - velocity[0], k * ve - velocity[1]
        tn, te = self._trim
        an, ae = VELOCITY_GAIN * en + tn, VELOCITY_GAIN * ee + te
        size, most = hypot(an, ae), MAX_LEAN * GRAVITY
        if size > most:
            an, ae = an * most / size, ae * most / size
        else:  # the integral stands while the lean is at its limit
            h = INTEGRAL_GAIN * EVERY * DT
            self._trim = (_within(tn + h * en, MAX_TRIM), _within(te + h * ee, MAX_TRIM))
        return an, ae


class AltitudeHold:
    """Thrust from altitude: proportional on altitude and climb rate over the hover thrust, tilt compensated.

    An integral on the climb rate carries what the hover thrust does not know: payload, battery, wind on the wing.
    """

    def __init__(self, tuning: Tuning) -> None:
        self._hover, self._gain = tuning.hover_thrust, tuning.altitude_integral * DT
        self._trim = 0.0

    def reset(self) -> None:
        """Forget the load."""
        self._trim = 0.0

    def step(self, target: float | None, altitude: float, climb: float, tilt_cosine: float) -> float:
        """Normalized thrust, 0…1, towards `target` metres above the ground; None means: come down and land."""
        asked = -LANDING_SINK if target is None else ALTITUDE_GAIN * (target - altitude)
        error = max(-MAX_SINK, min(MAX_CLIMB, asked)) - climb
        acceleration = CLIMB_GAIN * error + self._trim
        thrust = self._hover * (1.0 + acceleration / GRAVITY) / max(tilt_cosine, 0.5)
        if 0.0 < thrust < 1.0:
            self._trim = _within(self._trim + self._gain * error, MAX_TRIM)
        return max(0.0, min(1.0, thrust))


def _nearer(value: tuple[float, float], target: tuple[float, float]) -> tuple[float, float]:
    """One sample of a lag of `SHAPING_S`."""
    return (value[0] + _SHARE * (target[0] - value[0]), value[1] + _SHARE * (target[1] - value[1]))


def _within(value: float, most: float) -> float:
    return max(-most, min(most, value))
