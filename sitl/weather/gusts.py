"""Moving air: a mean wind, Dryden turbulence at low altitude, and discrete 1 − cos gusts. Pure.

Source: MIL-F-8785C, section 3.7: 3.7.1.2 (Dryden forms), 3.7.1.3 (the discrete gust) and 3.7.3 (low altitude: scale
lengths and intensities); the same numbers stand in MIL-HDBK-1797, appendix A. Turbulence is taken as frozen and carried
past the hovering vehicle by the mean wind, so V is the mean wind's speed: the standard's V is an aeroplane's airspeed,
and that its forms hold for a vehicle that hovers is a guess.

Each colour of the noise is sampled exactly: transition and covariance are those of the continuous process.
"""

from dataclasses import dataclass
from math import cos, exp, pi, radians, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from sitl.attitude import ZERO, Vector

FOOT = 0.3048
"""m, by definition."""

STREAM = 1
"""Distinguishes this generator from the others of the same seed and segment."""

LOWEST_FT = 10.0
"""The standard's formulas begin at this height."""

BLOCK = 1024


@dataclass(frozen=True, slots=True)
class Gust:
    """A discrete gust: rises as 1 − cos within `rise_s`, stays `hold_s`, falls as it rose; peak in m/s, NED.

    `at_s` counts from the beginning of the window.
    """

    at_s: float
    rise_s: float
    hold_s: float
    peak: Vector

    def share(self, t: float) -> float:
        """How much of the peak blows at t seconds of window time, 0…1."""
        since = t - self.at_s
        left = 2.0 * self.rise_s + self.hold_s - since
        return rise(min(since, left), self.rise_s)


def rise(t: float, length: float) -> float:
    """½ (1 − cos(π t / length)) from 0 to 1 within `length` seconds, 0 before and 1 after (MIL-F-8785C, 3.7.1.3)."""
    if t <= 0.0:
        return 0.0
    return 1.0 if t >= length else 0.5 * (1.0 - cos(pi * t / length))


@dataclass(frozen=True, slots=True)
class Wind:
    """The air of a scenario. Mean speed in m/s and where it comes from in degrees from north.

    `turbulence` is the wind speed at 6 m (20 ft) that sets the Dryden intensity, m/s: 7.7 light, 15.4 moderate, 23.2
    severe (15, 30 and 45 knots); 0 is none. `span_m` is the wing span, which filters the air's rotation.
    """

    mean: float
    from_deg: float
    turbulence: float
    span_m: float
    gusts: tuple[Gust, ...] = ()


@dataclass(frozen=True, slots=True)
class Intensity:
    """Dryden scale lengths, m, and standard deviations, m/s: along the mean wind (u), across (v), vertical (w)."""

    length_u: float
    length_w: float
    sigma_u: float
    sigma_w: float


def low_altitude(height: float, wind_at_6m: float) -> Intensity:
    """Scale lengths and intensities below 1000 ft, at `height` m (MIL-F-8785C, 3.7.3).

    L_w = h, L_u = L_v = h / (0.177 + 0.000823 h)^1.2, σ_w = 0.1 W20, σ_u = σ_v = σ_w / (0.177 + 0.000823 h)^0.4, with h
    in feet; below 10 ft it is taken at 10 ft.
    """
    h = max(height / FOOT, LOWEST_FT)
    k = 0.177 + 0.000823 * h
    sigma_w = 0.1 * wind_at_6m
    return Intensity(FOOT * h / k**1.2, FOOT * h, sigma_w / k**0.4, sigma_w)


class Longitudinal:
    """H(s) = √(2 τ) / (1 + τ s) of unit variance: first-order noise, sampled every `dt` s."""

    def __init__(self, tau: float, dt: float) -> None:
        self._pole = exp(-dt / tau)
        self._gain = sqrt(1.0 - self._pole**2)
        self.value = 0.0

    def step(self, white: float) -> float:
        """Next value from one standard normal draw."""
        self.value = self._pole * self.value + self._gain * white
        return self.value


class Transverse:
    """H(s) ∝ (1 + √3 τ s) / (1 + τ s)² of unit variance, sampled every `dt` s.

    In companion form with a = 1/τ: x'' + 2a x' + a² x = white noise, whose stationary covariance is
    diag(1/(4a³), 1/(4a)); the output a² (x + √3 τ x') then has the variance a, and is divided by √a. The noise that
    enters within a sample has the covariance P − A P Aᵀ.
    """

    def __init__(self, tau: float, dt: float) -> None:
        a = 1.0 / tau
        e: float = exp(-a * dt)
        self._a11, self._a12 = e * (1.0 + a * dt), e * dt
        self._a21, self._a22 = -e * a * a * dt, e * (1.0 - a * dt)
        transition = np.array([[self._a11, self._a12], [self._a21, self._a22]])
        stationary = np.diag([1.0 / (4.0 * a**3), 1.0 / (4.0 * a)])
        entering = stationary - transition @ stationary @ transition.T
        # By hand: it is all but singular for short samples, where a library's Cholesky may give up.
        e11, e21, e22 = float(entering[0, 0]), float(entering[1, 0]), float(entering[1, 1])
        self._l11 = sqrt(max(e11, 0.0))
        self._l21 = e21 / self._l11 if self._l11 > 0.0 else 0.0
        self._l22 = sqrt(max(e22 - self._l21**2, 0.0))
        self._c1, self._c2 = a * sqrt(a), sqrt(3.0 * a)
        self._x = self._v = 0.0

    def step(self, white: float, other: float) -> float:
        """Next value from two standard normal draws."""
        x, v = self._x, self._v
        self._x = self._a11 * x + self._a12 * v + self._l11 * white
        self._v = self._a21 * x + self._a22 * v + self._l21 * white + self._l22 * other
        return self._c1 * self._x + self._c2 * self._v


class Dryden:
    """Velocity (u, v, w; m/s) and rotation (p, q, r; rad/s) of turbulent air about along-wind, across, down axes.

    p: Φ(Ω) = σ_w²/L_w · 0.8 (π L_w / 4b)^⅓ / (1 + (4bΩ/π)²), as noise of its own; q and r follow from the gradients of
    w and v along the wind: q = s/V / (1 + 4b s/(πV)) · w, r = s/V / (1 + 3b s/(πV)) · v (MIL-F-8785C, 3.7.1.2). It
    starts from zero.
    """

    def __init__(self, intensity: Intensity, speed: float, span: float, dt: float) -> None:
        i = intensity
        self._u = Longitudinal(i.length_u / speed, dt)
        self._v = Transverse(i.length_u / speed, dt)
        self._w = Transverse(i.length_w / speed, dt)
        self._p = Longitudinal(4.0 * span / (pi * speed), dt)
        self._sigma_u, self._sigma_w = i.sigma_u, i.sigma_w
        # ∫ Φ_p dΩ from 0: the Lorentzian's is π/2 · π/(4b)
        variance = i.sigma_w**2 / i.length_w * 0.8 * (pi * i.length_w / (4.0 * span)) ** (1 / 3) * pi**2 / (8.0 * span)
        self._sigma_p = sqrt(variance)
        self._q = _Gradient(4.0 * span / (pi * speed), speed, dt)
        self._r = _Gradient(3.0 * span / (pi * speed), speed, dt)

    def step(self, white: list[float]) -> tuple[Vector, Vector]:
        """Velocity and rotation at the next sample from six standard normal draws."""
        a, b, c, d, e, f = white
        v = self._sigma_u * self._v.step(b, c)
        w = self._sigma_w * self._w.step(d, e)
        velocity = (self._sigma_u * self._u.step(a), v, w)
        return velocity, (self._sigma_p * self._p.step(f), self._q.step(w), self._r.step(v))


class _Gradient:
    """s / V / (1 + τ s): the input minus its first-order low-pass, over V τ."""

    def __init__(self, tau: float, speed: float, dt: float) -> None:
        self._pole, self._over = exp(-dt / tau), 1.0 / (speed * tau)
        self._slow = 0.0

    def step(self, value: float) -> float:
        self._slow = self._pole * self._slow + (1.0 - self._pole) * value
        return self._over * (value - self._slow)


class Air:
    """The air of one flight, restarted with each segment; it comes up within `lead_s`, as 1 − cos."""

    def __init__(self, wind: Wind, seed: int, height: float, lead_s: float, dt: float) -> None:
        self._wind, self._seed, self._height, self._lead, self._dt = wind, seed, height, lead_s, dt
        heading = radians(wind.from_deg)
        self._along = (-cos(heading), -sin(heading))  # where it blows to, north and east

    def begin(self, stream: int) -> None:
        """Start a segment from its first sample."""
        wind = self._wind
        self._rng = np.random.default_rng([self._seed, stream, STREAM])
        self._rows: NDArray[np.float64] = np.empty((0, 6))
        self._k = self._next = 0
        intensity = low_altitude(self._height, wind.turbulence)
        self._dryden = Dryden(intensity, wind.mean, wind.span_m, self._dt) if wind.turbulence else None

    def sample(self) -> tuple[Vector, Vector]:
        """Velocity of the air, m/s north-east-down, and its rotation about the same axes, rad/s."""
        t = self._k * self._dt
        self._k += 1
        (u, v, w), (p, q, r) = self._turbulence()
        share = rise(t, self._lead) if self._lead else 1.0
        u = share * (self._wind.mean + u)
        north, east = self._level(u, share * v)
        down = share * w
        for gust in self._wind.gusts:
            g = gust.share(t - self._lead)
            north, east, down = north + g * gust.peak[0], east + g * gust.peak[1], down + g * gust.peak[2]
        p, q = self._level(share * p, share * q)
        return (north, east, down), (p, q, share * r)

    def _turbulence(self) -> tuple[Vector, Vector]:
        if self._dryden is None:
            return ZERO, ZERO
        if self._next == len(self._rows):
            self._rows, self._next = self._rng.standard_normal((BLOCK, 6)), 0
        row = self._rows[self._next].tolist()
        self._next += 1
        return self._dryden.step(row)

    def _level(self, along: float, across: float) -> tuple[float, float]:
        """Along and across the wind to north and east."""
        c, s = self._along
        return c * along - s * across, s * along + c * across
