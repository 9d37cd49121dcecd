"""Bounds of a transfer function's gain over whole arcs of the unit circle: what makes a norm a proof.

With z = z0 (1 + j t) / (1 - j t) a real t runs along the circle (t = tan(angle / 2), counted from z0), and

    G(z) = D + C R B + 2 z0 C R (sum over k >= 1 of (-j t)^k W^(k-1)) R B,    R = (z0 I - A)^-1,  W = 2 z0 R - I

is a power series in t. Its first ORDER terms are kept; the rest is at most a geometric series in ||(t W)^POWER||.
Nothing here depends on eigenvalues, which rounding scatters where poles are close together. What rounding does to
the response itself is allowed for, entry by entry: |C R| (I + |A|) |R B| times a few units of rounding (N. J. Higham,
"Accuracy and Stability of Numerical Algorithms", 2nd ed., 2002, section 9).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Scaling = Callable[[ComplexArray, Array], Array]
"""From responses (N, m, m), and the sizes of what they are summed from, to positive diagonals (N, m): the gain looked
at is that of d_i G_ij / d_j."""

ORDER, POWER = 12, 8
"""Terms of the series, and the power of W whose norm bounds the rest."""

ROUNDING = 4.0 * float(np.finfo(float).eps)

EDGES = 32
"""Of the first arcs, in logarithmic and in linear steps."""

MOST_ARCS = 20_000


@dataclass(frozen=True, slots=True)
class Bracket:
    """Bounds of the largest gain: low is measured at `angle` (rad per sample), high holds at every angle.

    Both are as computed; `rounding` is to be added to high for what floating point may have done to it. They are as
    near to each other as was asked for if `converged`.
    """

    low: float
    high: float
    rounding: float
    angle: float
    converged: bool


def gain_bracket(system: Any, tolerance: float, enough: float = 0.0, scaling: Scaling | None = None) -> Bracket:
    """The largest gain (singular value) of a stable system over all frequencies, of a scaled one with `scaling`.

    low and high are `tolerance` (relative) or `enough` (absolute) apart, unless MOST_ARCS did not suffice or a pole
    lies on the unit circle to the last bit.
    """
    low, angle, highest, looked = 0.0, 0.0, 0.0, 0
    try:
        system, (middle, half) = _scaled(system), _first_arcs()
        while len(middle):
            arcs = Arcs.around(system, middle, half, scaling)
            low, angle = max((low, angle), arcs.highest())
            high = max(low * (1.0 + tolerance), low + enough)
            ceilings, rounding = arcs.ceilings()
            still, looked = np.flatnonzero(~(ceilings <= high)), looked + len(middle)
            if len(still) and looked > MOST_ARCS:
                return Bracket(low, float(np.max(ceilings)), float(np.max(rounding)), angle, converged=False)
            highest = max(highest, float(np.max(np.delete(ceilings + rounding, still), initial=0.0)))
            middle, half = arcs.at(still).parts()
    except np.linalg.LinAlgError:
        return Bracket(low, float("inf"), 0.0, angle, converged=False)
    return Bracket(low, high, max(highest - high, 0.0), angle, converged=True)


@dataclass(frozen=True, slots=True, eq=False)
class Arcs:
    """N arcs of the circle: `terms` (N, ORDER + 1, p, m) of the series in t / tan(half / 2), and what bounds the rest.

    `beyond` (N, p, m) bounds the terms left out, `rounding` (N, p, m) the error of the response itself, entry by entry.
    """

    middle: Array
    half: Array
    terms: ComplexArray
    beyond: Array
    rounding: Array

    @classmethod
    def around(cls, system: Any, middle: Array, half: Array, scaling: Scaling | None = None) -> "Arcs":
        """The arcs middle ± half (rad per sample, half < pi / 2)."""
        n, z, t = system.nstates, np.exp(1j * middle)[:, None, None], np.tan(half / 2.0)[:, None, None]
        R = np.linalg.inv(z * np.eye(n) - system.A)
        X, Y, tW = R @ system.B, system.C @ R, t * (2.0 * z * R - np.eye(n))
        terms, V = [system.D + system.C @ X], 2.0 * z * t * X
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # what overflows is no bound
            for k in range(1, ORDER + 1):
                terms.append((-1j) ** k * (Y @ V))
                V = tW @ V
            left = np.zeros((len(middle), V.shape[2]))
            for _ in range(POWER):
                left, V = left + np.linalg.norm(V, axis=1), tW @ V
            for _ in range(POWER.bit_length() - 1):
                tW = tW @ tW
            left = left / np.maximum(1.0 - np.linalg.norm(tW, axis=(1, 2)), 0.0)[:, None]
        beyond = np.linalg.norm(Y, axis=2)[:, :, None] * left[:, None, :]
        sizes = np.abs(Y) @ (np.eye(n) + np.abs(system.A)) @ np.abs(X) + np.abs(system.D)
        d = np.ones((len(t), 1)) if scaling is None else scaling(terms[0], sizes)
        ratio = d[:, :, None] / d[:, None, :]
        series = np.asarray(np.stack(terms, axis=1) * ratio[:, None], dtype=np.complex128)
        return cls(middle, half, series, beyond * ratio, ROUNDING * sizes * ratio)

    def at(self, index: NDArray[np.intp]) -> "Arcs":
        """Some of them."""
        return Arcs(self.middle[index], self.half[index], self.terms[index], self.beyond[index], self.rounding[index])

    def highest(self) -> tuple[float, float]:
        """The largest gain in a middle, and where."""
        gains = np.linalg.norm(self.terms[:, 0], 2, axis=(1, 2))
        k = int(np.argmax(gains))
        return float(gains[k]), float(np.pi - abs(np.pi - abs(self.middle[k])))

    def ceilings(self) -> tuple[Array, Array]:
        """Upper bounds of the gain over each arc (inf where there is none), and what rounding may add to them."""
        rounding, beyond = (np.linalg.norm(part, axis=(1, 2)) for part in (self.rounding, self.beyond))
        squares = self._squares()
        bound = np.sqrt(np.minimum(_coarse(squares), _fine(squares))) + beyond
        return np.where(np.isnan(bound), np.inf, bound), rounding

    def parts(self) -> tuple[Array, Array]:
        """Each arc in three, (middles, halves); the middle one sits where the gain peaks by its parabola, if inside."""
        a, b, C = _seen_from_largest(self._squares()[:, :3])
        apart = a[:, :1] - np.diagonal(C[:, 0], axis1=1, axis2=2).real
        bend = a[:, 2] + np.sum(np.abs(b[:, 1]) ** 2 / np.where(apart > 0.0, apart, np.inf), axis=1)
        peak = np.where(bend < 0.0, -a[:, 1] / (2.0 * np.where(bend < 0.0, bend, -1.0)), np.sign(a[:, 1]))
        centre = self.middle + self.half * np.clip(peak, -2.0 / 3.0, 2.0 / 3.0)
        third = self.half / 3.0
        ends = np.stack([self.middle - self.half, centre - third, centre + third, self.middle + self.half])
        middle, half = ((ends[1:] + ends[:-1]) / 2.0).ravel(), ((ends[1:] - ends[:-1]) / 2.0).ravel()
        kept = half > 1e-3 * np.tile(third, 3)  # beside a middle part at the edge nothing is left
        return middle[kept], half[kept]

    def _squares(self) -> ComplexArray:
        """G G* or G* G, whichever is smaller, as a series in the same variable, (N, 2 ORDER + 1, r, r)."""
        G = self.terms if self.terms.shape[2] <= self.terms.shape[3] else self.terms.transpose(0, 1, 3, 2)
        H = np.zeros((len(G), 2 * ORDER + 1, G.shape[2], G.shape[2]), dtype=complex)
        G_star = G.conj().transpose(0, 1, 3, 2)
        for i in range(ORDER + 1):
            H[:, i : i + ORDER + 1] += G[:, i : i + 1] @ G_star
        return H


def _coarse(H: ComplexArray) -> Array:
    """Upper bound over -1 <= t <= 1 of the largest eigenvalue of the sum of t^k H[:, k], H (N, K, r, r).

    The largest eigenvalue of H0 + t H1 is convex in t, so an end is worst; the rest is bounded term by term.
    """
    ends = np.maximum(*(np.linalg.eigvalsh(H[:, 0] + sign * H[:, 1])[:, -1] for sign in (1.0, -1.0)))
    sizes = np.linalg.eigvalsh(H[:, 2:])
    rest = np.maximum(sizes[:, 0::2, -1], 0.0).sum(axis=1) + np.abs(sizes[:, 1::2]).max(axis=2).sum(axis=1)
    return np.asarray(np.maximum(ends + rest, 0.0))


def _fine(H: ComplexArray) -> Array:
    """The same, sharp around a peak; inf where it does not hold because two eigenvalues are too close.

    With a the entry of the largest eigenvector of H0, C the block of the others and b what couples them, no eigenvalue
    exceeds a + |b|^2 / (a - largest of C) while a stays above C. |t|^k <= t^2 makes a parabola of it.
    """
    a, b, C = _seen_from_largest(H)
    others = np.linalg.norm(C, axis=(2, 3))
    above = a[:, 0] - np.sum(np.abs(a[:, 1:]), axis=1) - np.sum(others[:, 1:], axis=1)
    gap = above - np.max(np.diagonal(C[:, 0], axis1=1, axis2=2).real, axis=1, initial=-np.inf)
    coupling = np.sum(np.linalg.norm(b[:, 1:], axis=2), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        bend = a[:, 2] + np.maximum(a[:, 4::2], 0.0).sum(axis=1) + np.abs(a[:, 3::2]).sum(axis=1) + coupling**2 / gap
        slope = np.abs(a[:, 1])
        top = a[:, 0] + np.where(slope < -2.0 * bend, -(slope**2) / (4.0 * bend), slope + bend)
    return np.asarray(np.where(gap > 0.0, np.maximum(top, 0.0), np.inf))


def _seen_from_largest(H: ComplexArray) -> tuple[Array, ComplexArray, ComplexArray]:
    """The series in the eigenvectors of H[:, 0]: the largest one's entry, its coupling to the others, their block."""
    _, vectors = np.linalg.eigh(H[:, :1])
    H = vectors.conj().swapaxes(2, 3) @ H @ vectors
    return H[:, :, -1, -1].real, H[:, :, :-1, -1], H[:, :, :-1, :-1]


def _first_arcs() -> tuple[Array, Array]:
    """Middles and halves, logarithmic and linear; the first and last are centred at 0 and pi, where peaks often lie."""
    edges = np.unique(np.concatenate([np.geomspace(1e-5, np.pi - 0.01, EDGES), np.linspace(0.1, np.pi - 0.01, EDGES)]))
    ends = np.concatenate([-edges[:1], edges, 2.0 * np.pi - edges[-1:]])
    return (ends[1:] + ends[:-1]) / 2.0, (ends[1:] - ends[:-1]) / 2.0


def _scaled(system: Any) -> Any:
    """States in units (powers of two, so that nothing is rounded) in which input drives and output shows them alike.

    States that no input reaches or no output shows at any frequency are left out, which is exact too.
    """
    z = np.exp(1j * _first_arcs()[0])[:, None, None]
    R = np.linalg.inv(z * np.eye(system.nstates) - system.A)
    driven = np.max(np.linalg.norm(R @ system.B, axis=2), axis=0)
    shown = np.max(np.linalg.norm(system.C @ R, axis=1), axis=0)
    kept = (driven > 0.0) & (shown > 0.0)
    unit = 2.0 ** np.round(0.5 * (np.log2(driven[kept]) - np.log2(shown[kept])))
    A = system.A[np.ix_(kept, kept)] * unit / unit[:, None]
    return ct.ss(A, system.B[kept] / unit[:, None], system.C[:, kept] * unit, system.D, system.dt)
