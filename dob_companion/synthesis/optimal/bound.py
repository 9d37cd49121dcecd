"""How good an observer could be: a bound on the attenuation of every stable causal F, of any order.

Each limit gets a multiplier that is nonnegative at every frequency, and the limits' excess is added to the squared
attitude error. What is left is quadratic in F and has no limits:

    min over stable causal F of  mean over the circle of  p |F|^2 + 2 Re(q* F) + c

a Wiener-Hopf problem. With p = |φ|^2, φ and 1/φ stable, its least value is

    mean of c - |[q / φ*]_+|^2             []_+: the causal part

(D. C. Youla, J. J. Bongiorno, H. A. Jabr, "Modern Wiener-Hopf design of optimal controllers", 1976). It lies below the
error of every F that keeps the limits, whatever the multipliers (weak duality: S. Boyd, L. Vandenberghe, "Convex
Optimization", 2004, chapter 5), so no accuracy of the search is taken on trust: the multipliers found on a coarse grid
are evaluated once more on a fine one, and what is left to trust is that grid and rounding. The best multipliers come
near the optimum itself: the problem is convex, and observers exist that keep the limits with room.

Here limits are the disk margin at every frequency, the RMS of the correction from gyro noise, and its peak where one is
asked. A delay margin and a slowest mode are not among them: they can only lower what is to be had.

On angles half a step aside from 0 everything is a real series in cosines and sines, so factors and causal parts are
real transforms (`Circle`). |M|^2 is taken out of p before the logarithm: an integrating plant has p zero at z = 1.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import fft, optimize

from dob_companion.synthesis.optimal.problem import Axis, Spectrum, Wanted, attitude_rms, responses

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SEARCHED, EVALUATED = 2**13, 2**17
"""Angles from 0 to pi of the search and of the evaluation. The sparse ones err by percents on a slow loop, to either
side; what multipliers they lead to is not affected."""

KNOTS, FIRST_KNOT = 60, 3e-3
"""Knots between which a multiplier is straight, even on a logarithmic scale from the first angle to pi."""

STEPS, ENOUGH, MEMORY = 300, 1e-6, 30
"""Of the search (L-BFGS): steps at most, the change of the value that ends it, and how many steps it remembers."""

FIRST, FAINTEST = 1e-4, 1e-10
"""Multipliers to begin with, and the least one of the noise: without any there may be no best F."""

SCALE = 1e3
"""A value of the order of 1 is what the search's tolerances are meant for."""


def attenuation_limit(axis: Axis, spectrum: Spectrum, wanted: Wanted) -> float:
    """An upper bound on RMS attitude error off / on, the plant as modelled, of every stable causal F within the limits.

    Limits are `wanted`'s disk margin, noise and peak. Its delay margin and slowest mode play no part, which can only
    raise the bound; neither do its gains.
    """
    return AttenuationLimits(axis, spectrum, wanted.noise_rms).of(wanted)


class AttenuationLimits:
    """The same for several limits of one axis in one weather; each search begins where the last one ended."""

    def __init__(self, axis: Axis, spectrum: Spectrum, noise_rms: float) -> None:
        """`noise_rms`: of the gyro, rad/s."""
        self._searched, self._evaluated = (Ground(axis, spectrum, noise_rms, count) for count in (SEARCHED, EVALUATED))
        self._last: Array | None = None

    def of(self, wanted: Wanted) -> float:
        """As `attenuation_limit`; infinite where the search found nothing that bounds."""
        dual = Dual(self._searched, wanted)
        begin = self._last if self._last is not None and len(self._last) == dual.size else None
        self._last = dual.best(begin)
        value = Dual(self._evaluated, wanted).value(self._last)[0]
        return float(1.0 / np.sqrt(value)) if value > 0.0 else float("inf")


class Circle:
    """Real series h_n z^-n at the angles (j + 1/2) pi / count, j = 0 … count-1; h_n for n = 0 … count-1."""

    def __init__(self, count: int) -> None:
        self.angles = np.pi * (np.arange(count) + 0.5) / count

    def factor(self, power: Array) -> Complex:
        """The stable factor with stable inverse of |φ|^2 = power, by its cepstrum (A. V. Oppenheim, R. W. Schafer)."""
        logs = np.log(power)
        cepstrum = fft.dct(logs, 2) / (2.0 * len(power))  # of log φ, n >= 1
        return np.asarray(np.exp(0.5 * logs - 1j * _sines(cepstrum)))

    def causal(self, values: Complex) -> Array:
        """h_n, n >= 0, of a series in both directions."""
        even = fft.dct(values.real, 2) / len(values)  # h_n + h_-n
        odd = fft.dst(values.imag, 2) / len(values)  # h_-n - h_n, from n = 1
        h = even / 2.0
        h[1:] -= odd[:-1] / 2.0
        return np.asarray(h)

    def values(self, h: Array) -> Complex:
        """Of the causal series."""
        return np.asarray(fft.dct(np.append(h[:1], h[1:] / 2.0), 3) - 1j * _sines(h))


class Ground:
    """What does not depend on the limits, on a circle of `count` angles.

    error   (weight, at, slope): the mean over the circle of weight |at + slope F|^2, summed, is the squared attitude
            error as a share of that without observer
    """

    def __init__(self, axis: Axis, spectrum: Spectrum, noise_rms: float, count: int) -> None:
        self.circle, self.count = Circle(count), count
        self.on = on = responses(axis, self.circle.angles)
        wind, hiss = spectrum.amplitude(on.angles, on.dt), spectrum.hiss(on.angles, noise_rms)
        none = np.zeros_like(on.N)
        share = count / attitude_rms(on, spectrum, noise_rms, none) ** 2
        from_d, from_n = on.attitude(none)
        held = on.to_attitude * on.late / on.denominator(none, 1.0)
        self.error = [(share * wind**2, from_d, -held * on.N), (share * hiss**2, from_n, -held * on.M)]
        self.hats = Hats(on.angles)


class Dual:
    """The bound as a function of the multipliers: that of the noise, then those of each limit at the knots."""

    def __init__(self, ground: Ground, wanted: Wanted) -> None:
        on, r = ground.on, 1.0 / wanted.disk_margin
        self._ground = ground
        self._limits = [((on.S - 0.5) / r, -on.S * on.late * on.N / r)]  # |at + slope F| <= 1
        if wanted.peak is not None:
            self._limits.append((np.zeros_like(on.S), on.M / wanted.peak))
        self._heard = on.M * (wanted.noise_rms / wanted.noise)
        self.size = 1 + KNOTS * len(self._limits)

    def best(self, begin: Array | None = None) -> Array:
        """The multipliers of the greatest value found."""

        def falling(shares: Array) -> tuple[float, Array]:
            value, slope = self.value(FIRST * shares)
            return -SCALE * value, -SCALE * FIRST * slope

        found = optimize.minimize(
            falling,
            np.ones(self.size) if begin is None else begin / FIRST,
            jac=True,
            method="L-BFGS-B",
            bounds=[(FAINTEST / FIRST, None)] + [(0.0, None)] * (self.size - 1),
            options={"maxiter": STEPS, "ftol": ENOUGH, "maxcor": MEMORY},
        )
        return np.asarray(FIRST * found.x)

    def value(self, multipliers: Array) -> tuple[float, Array]:
        """A lower bound on (RMS attitude error on / off)^2, and its slope: the limits' excess at the F it is met by."""
        ground, M = self._ground, self._ground.on.M
        noise, at_knots = multipliers[0], np.split(multipliers[1:], len(self._limits))
        weights = [ground.hats.between(each) for each in at_knots]
        p, q = noise * np.abs(self._heard) ** 2, np.zeros(ground.count, np.complex128)
        rest = -noise - sum(float(np.mean(weight)) for weight in weights)
        limits = ((weight, *limit) for weight, limit in zip(weights, self._limits, strict=True))
        for weight, at, slope in (*ground.error, *limits):
            p += weight * np.abs(slope) ** 2
            q = np.asarray(q + weight * np.conj(slope) * at, np.complex128)
            rest += float(np.mean(weight * np.abs(at) ** 2))
        factor = M * ground.circle.factor(p / np.abs(M) ** 2)
        g = ground.circle.causal(np.asarray(q / np.conj(factor), np.complex128))
        F = -ground.circle.values(g) / factor
        excess = [ground.hats.gathered(np.abs(at + slope * F) ** 2 - 1.0) for at, slope in self._limits]
        heard = float(np.mean(np.abs(self._heard * F) ** 2)) - 1.0
        return rest - float(np.sum(g**2)), np.concatenate([[heard], *excess])


class Hats:
    """Functions of the angle that are straight between knots, on a logarithmic scale, and level below the first."""

    def __init__(self, angles: Array) -> None:
        knots = np.geomspace(FIRST_KNOT, np.pi, KNOTS)
        place = np.interp(np.log(angles), np.log(knots), np.arange(KNOTS))
        self._left = np.minimum(place.astype(int), KNOTS - 2)
        self._part = place - self._left

    def between(self, at_knots: Array) -> Array:
        """From the values at the knots."""
        return np.asarray(at_knots[self._left] * (1.0 - self._part) + at_knots[self._left + 1] * self._part)

    def gathered(self, values: Array) -> Array:
        """The mean over the circle of values times each hat."""
        here = np.bincount(self._left, values * (1.0 - self._part), KNOTS)
        return np.asarray((here + np.bincount(self._left + 1, values * self._part, KNOTS)) / len(values))


def _sines(h: Array) -> Array:
    """sum h_n sin(n angle), n >= 1."""
    return np.asarray(fft.dst(np.append(h[1:] / 2.0, 0.0), 3))
