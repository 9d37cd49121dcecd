"""Position hold: from where it is to how it should lean, and from how high it is to how much thrust."""

from math import hypot, sqrt

from sitl.attitude import LEVEL, Quaternion, Vector
from sitl.autopilot.tuning import Tuning
from sitl.dynamics import DT, GRAVITY

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
    """

    def __init__(self) -> None:
        self.reset(0.0, 0.0)

    def reset(self, north: float, east: float) -> None:
        """Hold this point from now on, m; forget the wind."""
        self.point = (north, east)
        self._trim = (0.0, 0.0)
        self._lean: Quaternion = LEVEL
        self._wait = 0

    def step(self, position: Vector, velocity: Vector) -> Quaternion:
        """Rotation that leans thrust the right way, for one sample; `position` and `velocity` north-east-down."""
        if self._wait == 0:
            self._wait = EVERY
            self._lean = self._update(position, velocity)
        self._wait -= 1
        return self._lean

    def _update(self, position: Vector, velocity: Vector) -> Quaternion:
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
        return lean(an, ae)


def lean(north: float, east: float) -> Quaternion:
    """Shortest rotation that turns thrust from straight up to one with this horizontal acceleration, m/s²."""
    size = sqrt(north * north + east * east + GRAVITY * GRAVITY)
    x, y, z = -north / size, -east / size, GRAVITY / size  # where body down points
    w = sqrt(0.5 * (1.0 + z))
    return (w, -0.5 * y / w, 0.5 * x / w, 0.0)


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


def _within(value: float, most: float) -> float:
    return max(-most, min(most, value))
