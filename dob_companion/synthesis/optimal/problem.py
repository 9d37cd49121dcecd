"""One axis or several, the weather and what is wanted, and the responses that every programme of one axis shares.

Command-invariant observers are d_hat = F (M y_n - N u_e), G = N / M and F any stable filter. With

    N = n(z) / z^k,  M = m(z) / z^k         G = n / m coprime, m monic of degree k
    T = z^-τ F N,  T_f = 1 - T              d -> d - z^-τ d_hat
    L = C G (1 + kI)                        open loop of rate and attitude, I the trapezoidal integral
    S = 1 / (1 + C G)                       the rate loop's sensitivity at the plant's input

a plant that answers g times as strongly as the model leaves

    θ = g I G (T_f d - (C + z^-τ F M) n) / (1 + g L + (g - 1) T)
    n -> d_hat = F M, d -> u_e + d = S T_f          (g = 1)

For g = 1 all of it is affine in F.
"""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from dob_companion.errors import UnsolvableError
from dob_companion.lti.response import response
from dob_companion.synthesis.spec.spectrum import Shape

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

POINTS = 1200
"""Angles over which variances are summed."""

LOWEST = 1e-5
"""The least of them, rad per sample."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Axis:
    """n, m: the plant's polynomials (moment to rate), descending powers, m monic, deg n < deg m, no common root;
    controller: SISO StateSpace of u = C (r - y_n); delay: samples; dt: s; attitude_gain: 1/s, 0 for none.
    """

    n: Array
    m: Array
    controller: Any
    delay: int
    dt: float
    attitude_gain: float

    @classmethod
    def of(cls, plant: Any, controller: Any, delay: int, attitude_gain: float) -> Self:
        """From discrete SISO systems without hidden modes.

        Raises UnsolvableError when the plant answers at once or has a pole outside the unit circle.
        """
        if np.any(plant.D):
            raise UnsolvableError("the plant answers at once: the method takes strictly proper ones")
        poles = np.linalg.eigvals(plant.A)
        m = np.atleast_1d(np.real(np.poly(poles)))
        markov, reach = [0.0], plant.B
        for _ in range(len(m) - 1):
            markov.append(float((plant.C @ reach)[0, 0]))
            reach = plant.A @ reach
        return cls(
            n=np.convolve(m, markov)[1 : len(m)],
            m=m,
            controller=controller,
            delay=delay,
            dt=float(plant.dt),
            attitude_gain=attitude_gain,
        )

    @property
    def order(self) -> int:
        """Of the plant."""
        return len(self.m) - 1


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """plant (p, m) and controller (m, p), discrete and minimal, the plant strictly proper; delays in samples, one for
    each moment; attitude_gain in 1/s."""

    plant: Any
    controller: Any
    delays: tuple[int, ...]
    attitude_gain: float

    def __post_init__(self) -> None:
        """Raise UnsolvableError when the plant answers at once."""
        if np.any(self.plant.D):
            raise UnsolvableError("the plant answers at once: the method takes strictly proper ones")


@dataclass(frozen=True, slots=True)
class Spectrum:
    """The disturbance: its shape and, where known, its RMS in normalized torque.

    With an RMS the gyro noise counts in the attitude error, with the observer off as with it on; without it the
    disturbance alone does, and its size plays no part.
    """

    shape: Shape
    rms: float | None = None

    def amplitude(self, angles: Array, dt: float) -> Array:
        """Standard deviation at each of the angles, so that the squares sum to rms^2 (1 without an RMS)."""
        power = shares(angles) * self.shape.density(angles, dt)
        return np.asarray((self.rms or 1.0) * np.sqrt(power / np.sum(power)))

    def hiss(self, angles: Array, noise_rms: float) -> Array:
        """Standard deviation at each angle of the gyro noise that counts in the attitude error."""
        return np.sqrt(shares(angles)) * (noise_rms if self.rms else 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """Limits, and what the observer is made for.

    disk_margin    least, of the rate loop with the observer
    noise          largest RMS of the correction that gyro noise alone causes, normalized torque
    noise_rms      of the gyro, rad/s, white
    peak           largest gain of n -> d_hat at any frequency, normalized torque per rad/s; None for any
    delay_margin   least, in further whole samples that the vehicle does not report
    slowest_s      time constant that no mode of the observer may exceed, s
    moment_hz      how often the applied moment is read (`observer.readings`); None where that of each sample is told
    gains          of the plant, beside 1, over which the attitude error is made small as well
    """

    disk_margin: float
    noise: float
    noise_rms: float
    peak: float | None = None
    delay_margin: int = 2
    slowest_s: float = 0.5
    moment_hz: float | None = None
    gains: tuple[float, ...] = (0.7, 1.3)


@dataclass(frozen=True, slots=True, eq=False)
class Responses:
    """On a grid of angles, each (count,): late = z^-τ, and N, M, C, S, L as above; dt in s."""

    angles: Array
    dt: float
    late: Complex
    N: Complex
    M: Complex
    C: Complex
    S: Complex
    L: Complex
    to_attitude: Complex
    """I G: from moment to attitude, nothing closed around it."""

    def T(self, F: Complex) -> Complex:
        """z^-τ F N: d -> z^-τ d_hat."""
        return self.late * F * self.N

    def sensitivity(self, F: Complex) -> Complex:
        """d -> u_e + d of the rate loop, S T_f."""
        return self.S * (1.0 - self.T(F))

    def attitude(self, F: Complex, gain: float = 1.0) -> tuple[Complex, Complex]:
        """θ from d and from n."""
        held = gain * self.to_attitude / self.denominator(F, gain)
        return held * (1.0 - self.T(F)), -held * (self.C + self.late * F * self.M)

    def denominator(self, F: Complex, gain: float) -> Complex:
        """1 + g L + (g - 1) T; where it stays the same, θ is affine in F at every gain."""
        return 1.0 + gain * self.L + (gain - 1.0) * self.T(F)


def grid(count: int = POINTS, lowest: float = LOWEST) -> Array:
    """Angles up to pi, half of them even on a logarithmic scale and half on a linear one."""
    half = count // 2
    return np.unique(np.concatenate([np.geomspace(lowest, np.pi, half), np.linspace(1e-3, np.pi, half)]))


def shares(angles: Array) -> Array:
    """Share of white noise's variance at each of rising angles that reach from 0 to pi."""
    return np.asarray(np.gradient(angles) / np.pi)


def responses(axis: Axis, angles: Array) -> Responses:
    """All of them at these angles, rad per sample, 0 < angle <= pi."""
    z = np.exp(1j * angles)
    # By roots: near z = 1 the coefficients of an integrating plant's m cancel to rounding.
    M = np.prod([1.0 - root / z for root in np.roots(axis.m)], axis=0)
    N = np.polyval(axis.n, z) / z**axis.order
    C = response(axis.controller, angles)[:, 0, 0]
    integral = axis.dt / 2.0 * (z + 1.0) / (z - 1.0)
    G = N / M
    around = 1.0 + axis.attitude_gain * integral
    return Responses(angles, axis.dt, z**-axis.delay, N, M, C, 1.0 / (1.0 + C * G), C * G * around, integral * G)


def attitude_rms(on: Responses, spectrum: Spectrum, noise_rms: float, F: Complex, gain: float = 1.0) -> float:
    """RMS attitude error, rad (with no RMS stated: per unit of disturbance); F = 0 is the observer off."""
    from_d, from_n = on.attitude(F, gain)
    wind, hiss = spectrum.amplitude(on.angles, on.dt), spectrum.hiss(on.angles, noise_rms)
    return float(np.sqrt(np.sum(np.abs(wind * from_d) ** 2) + np.sum(np.abs(hiss * from_n) ** 2)))


def attenuation(on: Responses, spectrum: Spectrum, noise_rms: float, F: Complex, gain: float = 1.0) -> float:
    """RMS attitude error with the observer off over that with it on."""
    off = attitude_rms(on, spectrum, noise_rms, np.zeros_like(F), gain)
    return off / attitude_rms(on, spectrum, noise_rms, F, gain)
