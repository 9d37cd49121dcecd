"""How good an observer could be: a bound on the attenuation of all stable ones, of any order, for one axis or several.

Command-invariant observers are D = F [M, -N] with G = M^-1 N (left coprime, stable) and F any stable causal m x p
matrix. With the plant as modelled, the attitude error and X = D_y = F M, T = z^-τ F N, S T_f = S (I - T) are affine
in F.

Each limit gets a multiplier that is nonnegative at every frequency, and the limits' excess is added to the squared
attitude error. What is left is quadratic in f, the entries of F, and has no limits:

    min over stable causal f of  mean over the circle of  f* H f + 2 Re(q* f) + c

a Wiener-Hopf problem. With H = Φ* Φ, Φ and its inverse stable (`spectral.py`), its least value is

    mean of c - |[Φ^-* q]_+|^2             []_+: the causal part

(D. C. Youla, J. J. Bongiorno, H. A. Jabr, "Modern Wiener-Hopf design of optimal controllers", 1976). It lies below the
error of every F that keeps the limits, whatever the multipliers (weak duality: S. Boyd, L. Vandenberghe, "Convex
Optimization", 2004, chapter 5), so no accuracy of the search is taken on trust: the multipliers found on a coarse grid
are evaluated once more on a fine one, and what is left to trust is that grid and rounding. For one axis the best
multipliers come near the optimum itself: the problem is convex, and observers exist that keep the limits with room.

Here limits are the disk margin at every frequency, the RMS of each moment's correction from gyro noise, and its peak
where one is asked (of several axes: a row of X is never larger than the largest singular value). A delay margin and a
slowest mode are not among them: they can only lower what is to be had.

**Several axes.** The disk margin of all loops at once, min over diagonal D of || D (S T_f - I/2) D^-1 || <= 1/margin,
is not convex. What it implies for each loop alone, |(S T_f)_ii - 1/2| <= 1/margin, is, and no other convex limit at a
single frequency says more: off the diagonal a triangular matrix may have any entries, so the closed convex hull of all
that keep the margin is the matrices whose diagonals do. The bound holds for every observer, and lies the further above
what can be had the more strongly axes are coupled.
"""

from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray
from scipy import linalg, optimize

from dob_companion.lti.response import response
from dob_companion.synthesis.optimal.problem import Block, Spectrum, Wanted
from dob_companion.synthesis.optimal.spectral import Circle, ratio_of

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SEARCHED, EVALUATED = 2**10, 2**13
"""Angles from 0 to pi of the search (of coupled axes half as many) and of the evaluation."""

ACCURATE = 1e-5
"""Accuracy of a spectral factor in the search, which feels its square."""

KNOTS, FIRST_KNOT = 60, 3e-3
"""Knots between which a multiplier is straight, even on a logarithmic scale from the first angle to pi."""

STEPS, ENOUGH, MEMORY = 300, 1e-6, 30
"""Of the search (L-BFGS): steps at most, the change of the value that ends it, and how many steps it remembers."""

FIRST, FAINTEST = 1e-4, 1e-10
"""Multipliers to begin with, and the least one of the noise: without any there may be no best F."""

SCALE = 1e3
"""A value of the order of 1 is what the search's tolerances are meant for."""


def attenuation_limit(block: Block, spectrum: Spectrum, wanted: Wanted) -> float | None:
    """An upper bound on RMS attitude error off / on, the plant as modelled, of every stable observer within the limits.

    Limits are `wanted`'s disk margin, noise and peak. Its delay margin and slowest mode play no part, which can only
    raise the bound; neither do its gains. None where the search found nothing that bounds.
    """
    return AttenuationLimits(block, spectrum, wanted.noise_rms).of(wanted)


class AttenuationLimits:
    """The same for several limits of one block in one weather; each search begins where the last one ended."""

    def __init__(self, block: Block, spectrum: Spectrum, noise_rms: float) -> None:
        """`noise_rms`: of the gyro, rad/s."""
        counts = (SEARCHED if len(block.delays) == 1 else SEARCHED // 2, EVALUATED)
        self._searched, self._evaluated = (Ground(block, spectrum, noise_rms, count) for count in counts)
        self._last: Array | None = None

    def of(self, wanted: Wanted) -> float | None:
        """As `attenuation_limit`."""
        dual = Dual(self._searched, wanted)
        begin = self._last if self._last is not None and len(self._last) == dual.size else None
        self._last = dual.best(begin)
        value = Dual(self._evaluated, wanted).bound(self._last)
        return float(1.0 / np.sqrt(value)) if value > 0.0 else None


class Ground:
    """What does not depend on the limits, on a circle of `count` angles; entries of F row by row, k = m p of them.

    H (count, k, k), q (count, k): of the squared attitude error as a share of that without observer, density included
    M, heard (count, p, p): the plant's, and the form of a row of F M, M M* transposed
    at (count, m), slopes (count, m, k): the diagonal of S T_f - I/2, affine in F
    """

    def __init__(self, block: Block, spectrum: Spectrum, noise_rms: float, count: int) -> None:
        self.circle = circle = Circle(count)
        self.hats = Hats(circle.angles)
        self.moments, self.rates = m, p = len(block.delays), len(block.plant.C)
        dt, z = float(block.plant.dt), np.exp(1j * circle.angles)
        self.M, N = (response(each, circle.angles) for each in left_coprime(block.plant))
        C, G, one = response(block.controller, circle.angles), np.linalg.solve(self.M, N), np.eye(m)
        late = np.exp(-1j * np.outer(circle.angles, block.delays))[:, None, :]
        integral = (dt / 2.0 * (z + 1.0) / (z - 1.0))[:, None, None]
        S = np.linalg.inv(one + C @ G)
        to_attitude = integral * G @ np.linalg.inv(one + C @ G * (1.0 + block.attitude_gain * integral))
        amplitudes = spectrum.amplitude(circle.angles, dt), spectrum.hiss(circle.angles, noise_rms)
        wind, hiss = (count * each[:, None, None] ** 2 for each in amplitudes)
        off = np.mean(np.sum(wind * np.abs(to_attitude) ** 2 + hiss * np.abs(to_attitude @ C) ** 2, axis=(1, 2)))
        # θ = to_attitude [(I - z^-τ F N) d - (C + z^-τ F M) n]
        left = to_attitude * late
        power = (wind * N @ _star(N) + hiss * self.M @ _star(self.M)) / off
        self.H = np.einsum("nij,nlk->nikjl", _star(left) @ left, power).reshape(count, m * p, m * p)
        self.q = (_star(left) @ to_attitude @ (hiss * C @ _star(self.M) - wind * _star(N)) / off).reshape(count, m * p)
        self.heard = (self.M @ _star(self.M)).swapaxes(1, 2)
        self.at = np.einsum("nii->ni", S) - 0.5
        self.slopes = -np.einsum("nij,nki->nijk", S * late, N).reshape(count, m, m * p)


class Dual:
    """The bound as a function of the multipliers: of the noise of each moment, then at the knots those of the disk
    margin of each moment and, where one is asked, of its peak."""

    def __init__(self, ground: Ground, wanted: Wanted) -> None:
        self._ground, self._margin = ground, wanted.disk_margin
        self._noise = (wanted.noise_rms / wanted.noise) ** 2
        self._peak = 0.0 if wanted.peak is None else 1.0 / wanted.peak**2
        self._shape = (1 if wanted.peak is None else 2, ground.moments, KNOTS)
        self.size = ground.moments + int(np.prod(self._shape))

    def best(self, begin: Array | None = None) -> Array:
        """The multipliers of the greatest value found."""

        def falling(shares: Array) -> tuple[float, Array]:
            value, slope = self.value(FIRST * shares)
            return -SCALE * value, -SCALE * FIRST * slope

        noises = self._ground.moments
        found = optimize.minimize(
            falling,
            np.ones(self.size) if begin is None else begin / FIRST,
            jac=True,
            method="L-BFGS-B",
            bounds=[(FAINTEST / FIRST, None)] * noises + [(0.0, None)] * (self.size - noises),
            options={"maxiter": STEPS, "ftol": ENOUGH, "maxcor": MEMORY},
        )
        return np.asarray(FIRST * found.x)

    def bound(self, multipliers: Array) -> float:
        """A lower bound on (RMS attitude error on / off)^2, whatever is left of H - Φ* Φ; minus infinity for none."""
        H, q, rest = self._lagrangian(multipliers)
        phi, g = self._factored(H, q)
        least = float(np.min(np.linalg.eigvalsh(ratio_of(H, phi))))  # H >= least Φ* Φ
        return rest - float(np.sum(g**2)) / min(least, 1.0) if least > 0.0 else -np.inf

    def value(self, multipliers: Array) -> tuple[float, Array]:
        """The Lagrangian at -Φ^-1 [Φ^-* q]_+, above the bound by the square of what is left of H - Φ* Φ, and its slope:
        the limits' excess at that F."""
        on, density = self._ground, self._ground.circle.density[:, None]
        H, q, rest = self._lagrangian(multipliers)
        phi, g = self._factored(H, q, ACCURATE)
        f = -np.linalg.solve(phi, on.circle.values(g)[:, :, None])
        least = rest + float(np.mean(np.sum((f.conj() * (H @ f + 2.0 * q[:, :, None])).real, axis=1)))
        X = f.reshape(-1, on.moments, on.rates) @ on.M
        heard = density * np.sum(np.abs(X) ** 2, axis=2)
        far = density * (np.abs(on.at + (on.slopes @ f)[:, :, 0]) * self._margin) ** 2
        slope = [self._noise * np.mean(heard, axis=0) - 1.0, on.hats.gathered(far - density)]
        if self._peak:
            slope.append(on.hats.gathered(self._peak * heard - density))
        return least, np.concatenate([each.ravel() for each in slope])

    def _lagrangian(self, multipliers: Array) -> tuple[Complex, Complex, float]:
        """H, q and c of the quadratic in F that is left."""
        on, density = self._ground, self._ground.circle.density
        noise, at_knots = np.split(multipliers, [on.moments])
        limits = density * on.hats.between(at_knots.reshape(self._shape))  # (1 or 2, m, count)
        disk = self._margin**2 * limits[0].T
        pulled = disk[:, :, None] * on.slopes.conj()
        H = on.H + pulled.swapaxes(1, 2) @ on.slopes
        rows = H.reshape(-1, on.moments, on.rates, on.moments, on.rates)
        for i, heard in enumerate(self._noise * noise[:, None] * density + self._peak * np.sum(limits[1:], axis=0)):
            rows[:, i, :, i] += heard[:, None, None] * on.heard
        q = on.q + (pulled.swapaxes(1, 2) @ on.at[:, :, None])[:, :, 0]
        spent = float(np.sum(noise) + np.sum(np.mean(limits, axis=2)))
        return H, q, 1.0 - spent + float(np.mean(np.sum(disk * np.abs(on.at) ** 2, axis=1)))

    def _factored(self, H: Complex, q: Complex, near: float = 0.0) -> tuple[Complex, Array]:
        """Φ, and [Φ^-* q]_+ as a series."""
        circle = self._ground.circle
        phi = circle.factor(H, near)
        return phi, circle.causal(np.asarray(np.linalg.solve(_star(phi), q[:, :, None])))[:, :, 0]


class Hats:
    """Functions of the angle that are straight between knots, on a logarithmic scale, and level below the first."""

    def __init__(self, angles: Array) -> None:
        knots = np.geomspace(FIRST_KNOT, np.pi, KNOTS)
        place = np.interp(np.log(angles), np.log(knots), np.arange(KNOTS))
        self._left = np.minimum(place.astype(int), KNOTS - 2)
        self._part = place - self._left

    def between(self, at_knots: Array) -> Array:
        """(…, count) from the values at the knots, (…, KNOTS)."""
        left, right = at_knots[..., self._left], at_knots[..., self._left + 1]
        return np.asarray(left * (1.0 - self._part) + right * self._part)

    def gathered(self, values: Array) -> Array:
        """The mean over angles of each column of `values` (count, columns) times each hat: (columns, KNOTS)."""
        here = [np.bincount(self._left, column * (1.0 - self._part), KNOTS) for column in values.T]
        next_one = [np.bincount(self._left + 1, column * self._part, KNOTS) for column in values.T]
        return np.asarray((np.array(here) + np.array(next_one)) / len(values))


def left_coprime(plant: Any) -> tuple[Any, Any]:
    """M (p, p) and N (p, m), stable, with G = M^-1 N, from any L with A - L C stable: the bound is the same for all.

    This one is that of the Kalman predictor for white noise on the moments and, on each rate, noise of the size of its
    first answers (M. Vidyasagar, "Control System Synthesis", 1985, chapter 4).
    """
    A, B, C, dt = plant.A, plant.B, plant.C, plant.dt
    answers = np.stack([C @ np.linalg.matrix_power(A, n) @ B for n in range(len(A))])
    R = np.diag(np.sum(answers**2, axis=(0, 2)))
    P = linalg.solve_discrete_are(A.T, C.T, B @ B.T, R)
    L = np.linalg.solve(R + C @ P @ C.T, C @ P @ A.T).T
    return ct.ss(A - L @ C, -L, C, np.eye(len(C)), dt), ct.ss(A - L @ C, B, C, np.zeros((len(C), B.shape[1])), dt)


def _star(M: Complex) -> Complex:
    return np.asarray(M.conj().swapaxes(-1, -2))
