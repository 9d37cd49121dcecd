"""Coupled axes: the best observer with given poles for each output, by cutting planes.

Output i of the observer is a functional observer of its own (D. G. Luenberger, IEEE TAC 16(6), 1971) that estimates
nothing of the plant's state: with given A, c (output normal, `realization.all_pass`) and any gains K, k

    ξ+ = A ξ + K y_n + H u_e,   d_hat_i = c ξ + k y_n,     T A_p - A T = K C_p,  H = T B_p,  c T + k C_p = 0

ξ - T x obeys A alone, so a moment that the observer is told of never reaches d_hat: command invariance is exact, and
T, H and the conditions are linear in (K, k). Its order is that of A, whatever the plant; per output
(order + 1) p - n_p numbers are free. With X = D_y, m x p, all that is asked is affine or convex in them:

    T = z^-τ X G,  T_f = I - T,  n -> d_hat = X,  RMS of row i to white noise = |(K, k)|     (output normal)

A bound on a largest singular value, or a least eigenvalue, is a bound for every pair of directions; the direction
that is worst at an angle is added as one disk or half-plane until all hold. Diagonal scalings of the disk margin's
bound are taken from the last observer, in turn with it.
"""

from dataclasses import dataclass
from typing import Any

import clarabel
import control as ct
import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from dob_companion.errors import UnsolvableError
from dob_companion.lti.response import response
from dob_companion.lti.statespace import diagonal
from dob_companion.observer.readings import MISREAD, missed
from dob_companion.synthesis.norms.structured import structured_bounds
from dob_companion.synthesis.optimal.poles import sections
from dob_companion.synthesis.optimal.problem import Block, Spectrum, Wanted, grid
from dob_companion.synthesis.optimal.realization import all_pass

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

POINTS = 500
"""Angles."""

ROOM = 0.02
"""Least eigenvalue of the Hermitian part of I - (1 - z^-j) T, for a delay of j samples that nobody reports."""

BROKEN, MOST_ROUNDS = 1e-4, 40
"""Share of a limit that may be exceeded, and how often directions are added."""

NEARLY = 0.7
"""Share of a limit from which the second largest singular value is bounded along with the largest."""

TURNS, STEADY = 4, 1e-4
"""How often scalings and the attitude error at other gains are taken anew, and the change of value that ends it."""


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """One output: A (n, n), c (1, n), and (K, k) = sum of free numbers times `basis` (free, n + 1, p), each with its T
    (free, n, n_p)."""

    A: Array
    c: Array
    basis: Array
    T: Array

    @classmethod
    def of(cls, plant: Any, x: Array, radius: float) -> "Row":
        """For the poles that x stands for (`poles.sections`). Raises UnsolvableError when no freedom is left."""
        A, c = all_pass(sections(x, radius))
        n, (p, states) = len(A), plant.C.shape
        units = np.eye((n + 1) * p).reshape(-1, n + 1, p)
        T = np.stack([linalg.solve_sylvester(-A, plant.A, unit[:n] @ plant.C) for unit in units])
        held = np.stack([(c @ t + unit[n:] @ plant.C).ravel() for t, unit in zip(T, units, strict=True)], axis=1)
        scale = np.linalg.norm(held, axis=1, keepdims=True)
        free = linalg.null_space(held / np.where(scale > 0.0, scale, 1.0), rcond=1e-12)
        if free.shape[1] == 0:
            raise UnsolvableError(f"{n} poles are too few for a plant of order {states}")
        return cls(A, c, np.tensordot(free.T, units, 1), np.tensordot(free.T, T, 1))

    def response(self, z: Complex) -> Complex:
        """Of each free number, at each z: (N, free, p)."""
        n = len(self.A)
        through = np.linalg.solve(
            (z[:, None, None] * np.eye(n) - self.A).swapaxes(1, 2), np.broadcast_to(self.c.T, (len(z), n, 1))
        )[:, :, 0]
        seen = np.concatenate([through, np.ones((len(z), 1))], axis=1)
        return np.asarray(np.einsum("wn,fnp->wfp", seen, self.basis))


@dataclass(slots=True, eq=False)
class _Cuts:
    """Disks |offset + slope y| <= size, or half-planes Re >= size."""

    half_plane: bool
    size: float
    offsets: list[complex]
    slopes: list[Complex]


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """rows of the observer, its free numbers y, X (N, m, p) on the programme's angles, value as of one axis."""

    rows: tuple[Row, ...]
    y: Array
    X: Complex
    value: float

    def observer(self, plant: Any) -> Any:
        """D(z), inputs [y_n; u_e]."""
        parts = np.split(self.y, np.cumsum([len(row.basis) for row in self.rows])[:-1])
        gains = [np.tensordot(y, row.basis, 1) for y, row in zip(parts, self.rows, strict=True)]
        told = [np.tensordot(y, row.T, 1) @ plant.B for y, row in zip(parts, self.rows, strict=True)]
        B = np.vstack([np.hstack([gain[:-1], H]) for gain, H in zip(gains, told, strict=True)])
        k = np.vstack([gain[-1:] for gain in gains])
        A, C = diagonal(*(row.A for row in self.rows)), diagonal(*(row.c for row in self.rows))
        return ct.ss(A, B, C, np.hstack([k, np.zeros((len(k), plant.B.shape[1]))]), plant.dt)


class Programme:
    """One block, one weather, one set of limits."""

    def __init__(self, block: Block, spectrum: Spectrum, wanted: Wanted) -> None:
        self.block, self.wanted = block, wanted
        self.dt = float(block.plant.dt)
        self.radius = float(np.exp(-self.dt / wanted.slowest_s))
        self.angles = grid(POINTS)
        self.z = np.exp(1j * self.angles)
        self.G, self.C = response(block.plant, self.angles), response(block.controller, self.angles)
        self.late = np.exp(-1j * np.outer(self.angles, block.delays))[:, :, None]
        integral = (self.dt / 2.0 * (self.z + 1.0) / (self.z - 1.0))[:, None, None]
        self.unit = np.eye(len(block.delays))
        around = self.C @ self.G
        self.S = np.linalg.inv(self.unit + around)
        self.L = around * (1.0 + block.attitude_gain * integral)
        self.to_attitude = integral * self.G
        self._wind = spectrum.amplitude(self.angles, self.dt)
        self._hiss = spectrum.hiss(self.angles, wanted.noise_rms)
        self._gains = (1.0, *wanted.gains)
        off = np.zeros_like(self.C)
        self._off = [self._power(off, gain) for gain in self._gains]

    def value(self, X: Complex) -> float:
        """RMS over the gains of attitude error on / off, all axes together."""
        return float(np.sqrt(np.mean([self._power(X, g) / o for g, o in zip(self._gains, self._off, strict=True)])))

    def attenuation(self, X: Complex, gain: float) -> float:
        """RMS attitude error off / on at one gain of the plant."""
        return float(np.sqrt(self._power(np.zeros_like(X), gain) / self._power(X, gain)))

    def solve(self, rows: tuple[Row, ...], start: Complex | None = None) -> Solved | None:
        """The best observer with these rows; None where nothing keeps the limits."""
        basis = self._basis(rows)
        X = np.zeros_like(self.C) if start is None else start
        best: Solved | None = None
        for _ in range(TURNS):
            y = self._within_limits(rows, basis, X)
            if y is None:
                break
            X = np.asarray(np.einsum("wfip,f->wip", basis, y))
            found = Solved(rows, y, X, self.value(X))
            done = best is not None and found.value > best.value * (1.0 - STEADY)
            if best is None or found.value < best.value:
                best = found
            if done:
                break
        return best

    def _basis(self, rows: tuple[Row, ...]) -> Complex:
        """X of each free number: (N, free, m, p)."""
        parts = []
        for i, row in enumerate(rows):
            seen = row.response(self.z)
            part = np.zeros((*seen.shape[:2], len(rows), seen.shape[2]), complex)
            part[:, :, i] = seen
            parts.append(part)
        return np.concatenate(parts, axis=1)

    def _attitude(self, X: Complex, gain: float) -> tuple[Complex, Complex, Complex, Complex, Complex]:
        """P, R_d, R_n of dθ = -P dX [R_d d + R_n n], and θ from d and from n."""
        T = self.late * X @ self.G
        closed = np.linalg.inv(self.unit + gain * self.L + (gain - 1.0) * T)
        v_d, v_n = closed @ (self.unit - T), -closed @ (self.C + self.late * X)
        held = gain * self.to_attitude
        P = held @ closed * self.late.swapaxes(1, 2)
        R_d = self.G @ (self.unit + (gain - 1.0) * v_d)
        R_n = np.eye(self.G.shape[1]) + (gain - 1.0) * self.G @ v_n
        return P, R_d, R_n, held @ v_d, held @ v_n

    def _power(self, X: Complex, gain: float) -> float:
        """Mean square of the attitude error."""
        *_, from_d, from_n = self._attitude(X, gain)
        return float(
            np.sum(self._wind[:, None, None] ** 2 * np.abs(from_d) ** 2)
            + np.sum(self._hiss[:, None, None] ** 2 * np.abs(from_n) ** 2)
        )

    def _quadratic(self, basis: Complex, X: Complex) -> tuple[Array, Array]:
        """A, c of |A y + c|^2 = value^2, linearized at X, as a triangular factor."""
        factor: Array = np.zeros((0, basis.shape[1] + 1))
        for gain, off in zip(self._gains, self._off, strict=True):
            P, R_d, R_n, from_d, from_n = self._attitude(X, gain)
            for size, R, at in ((self._wind, R_d, from_d), (self._hiss, R_n, from_n)):
                if not np.any(size):
                    continue
                weight = (size / np.sqrt(off * len(self._gains)))[:, None, None]
                slopes = np.einsum("wai,wfip,wpb->wabf", weight * P, basis, R, optimize=True)
                level = weight * (at + P @ X @ R)
                columns = np.concatenate([-slopes.reshape(-1, slopes.shape[-1]), level.reshape(-1, 1)], axis=1)
                factor = np.asarray(np.linalg.qr(np.vstack([factor, columns.real, columns.imag]), mode="r"))
        return factor[:, :-1], factor[:, -1]

    def _within_limits(self, rows: tuple[Row, ...], basis: Complex, X: Complex) -> Array | None:
        A, c = self._quadratic(basis, X)
        scales = structured_bounds(self._sensitivity(X) - 0.5 * self.unit)[1]
        disk = _Cuts(False, 1.0 / self.wanted.disk_margin, [], [])
        peak = _Cuts(False, self.wanted.peak or np.inf, [], [])
        readings = _Cuts(False, MISREAD, [], [])
        delay = _Cuts(True, ROOM, [], [])
        y = None
        for _ in range(MOST_ROUNDS):
            y = _cone_programme(
                A, c, [cuts for cuts in (disk, peak, readings, delay) if cuts.offsets], rows, self.wanted
            )
            if y is None:
                return None
            X = np.asarray(np.einsum("wfip,f->wip", basis, y))
            broken = self._cut_disk(disk, X, basis, scales)
            if self.wanted.peak is not None:
                broken |= self._cut_peak(peak, X, basis)
            if self.wanted.moment_hz is not None:
                broken |= self._cut_readings(readings, self.wanted.moment_hz, X, basis)
            for j in range(1, self.wanted.delay_margin + 1):
                broken |= self._cut_delay(delay, j, X, basis, scales)
            if not broken:
                break
        return y

    def _sensitivity(self, X: Complex) -> Complex:
        """d -> u_e + d of the rate loop."""
        return np.asarray(self.S @ (self.unit - self.late * X @ self.G))

    def _cut_disk(self, cuts: _Cuts, X: Complex, basis: Complex, scales: Array) -> bool:
        M = self._sensitivity(X) - 0.5 * self.unit
        U, sizes, Vh = np.linalg.svd(M * scales[:, :, None] / scales[:, None, :])
        at = _tops(sizes[:, 0] / cuts.size - 1.0)
        for k in at:
            for r in np.flatnonzero(sizes[k] >= NEARLY * cuts.size)[:2]:  # the second one is next
                u, v = U[k, :, r].conj() * scales[k], Vh[k, r].conj() / scales[k]
                cuts.offsets.append(complex(u @ (self.S[k] - 0.5 * self.unit) @ v))
                left = (u @ self.S[k]) * self.late[k, :, 0]
                cuts.slopes.append(-np.einsum("i,fip,p->f", left, basis[k], self.G[k] @ v))
        return len(at) > 0

    def _cut_peak(self, cuts: _Cuts, X: Complex, basis: Complex) -> bool:
        U, sizes, Vh = np.linalg.svd(X)
        at = _tops(sizes[:, 0] / cuts.size - 1.0)
        for k in at:
            cuts.offsets.append(0.0)
            cuts.slopes.append(np.einsum("i,fip,p->f", U[k, :, 0].conj(), basis[k], Vh[k, 0].conj()))
        return len(at) > 0

    def _cut_readings(self, cuts: _Cuts, moment_hz: float, X: Complex, basis: Complex) -> bool:
        left = missed(self.angles, self.dt, moment_hz)[:, None, None] * self.S * self.late.swapaxes(1, 2)
        U, sizes, Vh = np.linalg.svd(left @ X @ self.G)
        at = _tops(sizes[:, 0] / cuts.size - 1.0)
        for k in at:
            cuts.offsets.append(0.0)
            right = self.G[k] @ Vh[k, 0].conj()
            cuts.slopes.append(np.einsum("i,fip,p->f", U[k, :, 0].conj() @ left[k], basis[k], right))
        return len(at) > 0

    def _cut_delay(self, cuts: _Cuts, j: int, X: Complex, basis: Complex, scales: Array) -> bool:
        turn, T = 1.0 - self.z**-j, self.late * X @ self.G
        M = self.unit - turn[:, None, None] * T * scales[:, :, None] / scales[:, None, :]
        least, vectors = np.linalg.eigh((M + M.conj().swapaxes(1, 2)) / 2.0)
        at = _tops(cuts.size - least[:, 0])
        for k in at:
            u, v = vectors[k, :, 0].conj() * scales[k], vectors[k, :, 0] / scales[k]
            cuts.offsets.append(complex(u @ v))
            cuts.slopes.append(-turn[k] * np.einsum("i,fip,p->f", u * self.late[k, :, 0], basis[k], self.G[k] @ v))
        return len(at) > 0


def _tops(excess: Array) -> NDArray[np.intp]:
    """Where a limit is broken, each the worst of its surroundings."""
    high = np.concatenate([[-np.inf], excess, [-np.inf]])
    return np.flatnonzero((excess > BROKEN) & (excess >= high[:-2]) & (excess > high[2:]))


def _cone_programme(A: Array, c: Array, cuts: list[_Cuts], rows: tuple[Row, ...], wanted: Wanted) -> Array | None:
    """min |A y + c|^2 within the cuts and the noise of each row."""
    n = A.shape[1]
    turned, left = np.linalg.qr(A)
    matrices, sides, cones = [], [], []
    for each in cuts:
        slopes, offsets = np.array(each.slopes), np.array(each.offsets)
        if each.half_plane:
            matrices.append(-slopes.real)
            sides.append(offsets.real - each.size)
            cones.append(clarabel.NonnegativeConeT(len(offsets)))
            continue
        cone = np.zeros((len(offsets), 3, n))
        cone[:, 1], cone[:, 2] = -slopes.real, -slopes.imag
        matrices.append(cone.reshape(-1, n))
        sides.append(np.stack([np.full(len(offsets), each.size), offsets.real, offsets.imag], axis=1).ravel())
        cones += [clarabel.SecondOrderConeT(3)] * len(offsets)
    first = 0
    for row in rows:
        count = len(row.basis)
        heard: Array = np.asarray(np.linalg.qr(row.basis.reshape(count, -1).T, mode="r"))
        part = np.zeros((1 + count, n))
        part[1:, first : first + count] = -heard * wanted.noise_rms / wanted.noise
        matrices.append(part)
        sides.append(np.eye(1, 1 + count).ravel())
        cones.append(clarabel.SecondOrderConeT(1 + count))
        first += count
    # In coordinates R y, in which the objective is round.
    inverse = linalg.solve_triangular(left, np.eye(n))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    answer = clarabel.DefaultSolver(
        sparse.csc_matrix(np.eye(n)),
        turned.T @ c,
        sparse.csc_matrix(np.vstack(matrices) @ inverse),
        np.concatenate(sides),
        cones,
        settings,
    ).solve()
    if str(answer.status) not in ("Solved", "AlmostSolved"):
        return None
    return np.asarray(inverse @ np.array(answer.x))
