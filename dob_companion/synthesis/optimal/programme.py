"""For fixed poles the best numerator is a cone programme: few unknowns, no other minimum than the best one.

F = z^k b(z) / a(z), deg b = deg a - k, is linear in b, and on the exact model all that is asked is convex in F: the
disk margin |S T_f - 1/2| <= 1/margin, a peak |F M| and what readings of the moment miss, |S T| times that share, are
disks at each angle, gyro noise in the correction is a norm, and 1 - (1 - z^-j) T, which must not circle the origin for
a delay of j samples that nobody reports, stays right of it.

Right of it is more than is needed: a line between it and the origin may stand at any slant, as long as the slants of
all angles together do not turn once around. Where an F is known that keeps the limits, lines are set across its own
values (`aim`). It keeps those lines, so that what is found with them is no worse; and they are set anew for that.

The attitude error at other gains of the plant is not affine in F. It is linearized at the last F and solved again
(Gauss and Newton), two to four times, until it does not change; the plant as modelled needs no linearization.

Poles and numerator move together by the same programme: F is linearized in the poles as well, and a trust region keeps
the step to where that holds. The optimum lies at a corner of many limits, where the value as a function of the poles
has kinks; a descent on its slope stops there, a step that knows the limits does not.
"""

from dataclasses import dataclass

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from dob_companion.observer.readings import MISREAD, missed
from dob_companion.synthesis.optimal.factors import Factors
from dob_companion.synthesis.optimal.limits import Limit
from dob_companion.synthesis.optimal.poles import FARTHEST, sections, slopes
from dob_companion.synthesis.optimal.problem import Responses, Spectrum, Wanted, attitude_rms, shares

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

ROOM = 0.02
"""Distance that 1 - (1 - z^-j) T keeps from the imaginary axis, and T_f where it is held to the right of it."""

DELAY, READINGS = "delay margin", "readings of the moment"

Band = tuple[float, float]
"""Angles from and to, rad per sample."""

FIRST_WATCHED = 20
"""Angles at which every limit is watched from the beginning; others are added where it is broken."""

MOST_ROUNDS, STEADY = 12, 1e-5
TURNS = 3
"""Solutions at most for one set of poles, and the change of the value that ends them."""

MATTERS = 1e-6
"""A multiplier above this counts as one."""


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """The best numerator for one set of poles.

    x       free numbers of the poles (`poles.sections`)
    value   RMS over the gains of attitude error on / off
    b       numerator, descending: F = z^k b / a
    F       on the programme's angles
    binding   names of the limits whose multipliers do not vanish
    """

    x: Array
    value: float
    b: Array
    F: Complex
    binding: tuple[str, ...]


class Programme:
    """One axis, one weather, one set of limits."""

    def __init__(
        self,
        on: Responses,
        order: int,
        spectrum: Spectrum,
        wanted: Wanted,
        factors: Factors | None = None,
        right: tuple[Band, ...] = (),
    ) -> None:
        """`order` is the plant's; `factors` are plants that must be stable as well; in the bands `right` T_f stays
        right of the imaginary axis, so that it has no zero outside the unit circle there."""
        self.on, self.spectrum, self.wanted, self.plant_order = on, spectrum, wanted, order
        self.radius = float(np.exp(-on.dt / wanted.slowest_s))
        self.z = np.exp(1j * on.angles)
        self._wind, self._hiss = spectrum.amplitude(on.angles, on.dt), spectrum.hiss(on.angles, wanted.noise_rms)
        self._heard = np.sqrt(shares(on.angles)) * wanted.noise_rms / wanted.noise * np.abs(on.M)
        self._gains = (1.0, *wanted.gains)
        off = np.zeros_like(on.N)
        self._off = [attitude_rms(on, spectrum, wanted.noise_rms, off, gain) for gain in self._gains]
        self._factors, self._F = factors, off
        self._fixed, self._turned = _limits(on, wanted, right), factors.limits(on, off) if factors else []
        self._aims = False
        every = max(1, len(on.angles) // FIRST_WATCHED)
        for limit in self._limits:
            limit.watched = np.arange(every // 2, len(on.angles), every, dtype=np.int64)

    @property
    def _limits(self) -> list[Limit]:
        return [*self._fixed, *self._turned]

    def aim(self, F: Complex | None) -> None:
        """Set the lines of the delay margin across an F's values, and from then on across each answer's; upright
        again for None."""
        self._aims = F is not None
        if F is not None:
            self._F = F
        for limit in self._fixed:
            limit.upright()

    def resume(self, at: Solved) -> None:
        """Aim at this answer again, after one that was not taken."""
        if self._aims:
            self._F = at.F

    def _turn(self, F: Complex) -> None:
        """Lines between values and the origin, to suit an F."""
        for limit in self._fixed:
            if self._aims and limit.name == DELAY:
                limit.across(F)
        turned = self._factors.limits(self.on, F) if self._factors else []
        for new, old in zip(turned, self._turned, strict=True):
            new.watched = old.watched
        self._turned = turned

    def value(self, F: Complex) -> float:
        """RMS over the gains of attitude error on / off."""
        on = [attitude_rms(self.on, self.spectrum, self.wanted.noise_rms, F, gain) for gain in self._gains]
        return float(np.sqrt(np.mean((np.array(on) / self._off) ** 2)))

    def solve(self, x: Array) -> Solved | None:
        """The best numerator for these poles (`poles.sections`); None where there is none within the limits."""
        basis = self._basis(x)
        last, found = np.inf, None
        for _ in range(TURNS if self._factors else MOST_ROUNDS):
            p, q = self._quadratic(self._F)
            self._turn(self._F)
            found = self._within_limits(basis, p, q, x)
            if found is None:
                return None
            self._F = found.F
            if abs(found.value - last) <= STEADY * found.value or self._convex:
                break
            last = found.value
        return found

    @property
    def _convex(self) -> bool:
        """Whether nothing is linearized, so that one round is enough."""
        return len(self._gains) == 1 and self._factors is None and not self._aims

    def _basis(self, x: Array) -> Complex:
        """z^(k + j) / a, j = deg a - k … 0, at each angle."""
        a = np.ones_like(self.z)
        for section in sections(x, self.radius):
            a = a * np.polyval(section, self.z)
        return np.asarray(self.z[:, None] ** np.arange(len(x), self.plant_order - 1, -1) / a[:, None])

    def _quadratic(self, at: Complex) -> tuple[Array, Complex]:
        """p and q with value^2 / 2 = sum p |F|^2 / 2 + Re(q* F) + const, linearized at an F."""
        on = self.on
        p, q = np.zeros(len(self.z)), np.zeros(len(self.z), complex)
        for gain, off in zip(self._gains, self._off, strict=True):
            denominator = on.denominator(at, gain)
            held = gain * on.to_attitude / denominator
            bend = (gain - 1.0) * on.late * on.N / denominator
            from_d, from_n = on.attitude(at, gain)
            for size, value, slope in (
                (self._wind, from_d, -held * on.late * on.N - bend * from_d),
                (self._hiss, from_n, -held * on.late * on.M - bend * from_n),
            ):
                weight = size**2 / (off**2 * len(self._gains))
                p += weight * np.abs(slope) ** 2
                q += weight * np.conj(slope) * (value - slope * at)
        return p, q

    def _within_limits(self, basis: Complex, p: Array, q: Complex, x: Array) -> Solved | None:
        # In coordinates in which the objective is |y - y0|^2 / 2: clustered poles make the powers of z alike.
        root = np.sqrt(p)
        Q, R = np.linalg.qr(_split(root[:, None] * basis))
        y0 = -Q.T @ _split(q / root)
        turned = linalg.solve_triangular(R, basis.T, trans="T").T
        found = self._watched_solution(np.eye(len(y0)), -y0, turned, np.zeros_like(self.z))
        if found is None:
            return None
        F: Complex = np.asarray(turned @ found.y, dtype=complex)
        return Solved(x, self.value(F), linalg.solve_triangular(R, found.y), F, self._binding(found))

    def step(self, from_: Solved, trust: float) -> Array | None:
        """Poles that are better by the programme linearized in poles and numerator at once, at most `trust` away."""
        p, q = self._quadratic(from_.F)
        self._turn(from_.F)
        root = np.sqrt(p)
        basis = self._basis(from_.x)
        turned = linalg.solve_triangular(np.linalg.qr(_split(root[:, None] * basis), mode="r"), basis.T, trans="T").T
        moved = np.hstack([turned, -from_.F[:, None] * slopes(from_.x, self.radius, self.z)])
        A = _split(root[:, None] * moved)
        c = _split(root * from_.F + q / root)
        found = self._watched_solution(A.T @ A, A.T @ c, moved, from_.F, Trust(len(from_.x), trust))
        return None if found is None else np.clip(from_.x + found.y[-len(from_.x) :], -FARTHEST, FARTHEST)

    def _watched_solution(
        self, P: Array, q: Array, basis: Complex, at: Complex, trust: "Trust | None" = None
    ) -> "Answer | None":
        """min y' P y / 2 + q' y for F = at + basis y within the limits, angles added until all hold."""
        heard = self._heard
        R: Array = np.asarray(
            np.linalg.qr(np.column_stack([_split(heard[:, None] * basis), _split(heard * at)]), mode="r")
        )
        found = None
        for _ in range(MOST_ROUNDS):
            found = _cone_programme(P, q, R, [_Watched(limit, at, basis) for limit in self._limits], trust)
            if found is None:
                return None
            F = at + basis @ found.y
            added = [limit.watch(limit.excess(F)) for limit in self._limits]
            if not any(added):
                break
        return found

    def _binding(self, found: "Answer") -> tuple[str, ...]:
        names = [limit.name for limit in self._limits] + ["noise"]
        return tuple(dict.fromkeys(name for name, dual in zip(names, found.duals, strict=True) if dual > MATTERS))


@dataclass(frozen=True, slots=True)
class Trust:
    """The last `count` unknowns stay within `size` in norm."""

    count: int
    size: float


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """y, and the largest multiplier of each limit and of the noise."""

    y: Array
    duals: tuple[float, ...]


class _Watched:
    """A limit at its watched angles, F = at + basis y."""

    def __init__(self, limit: Limit, at: Complex, basis: Complex) -> None:
        here = limit.watched
        slope = limit.slant[here] * limit.slope[here] if limit.half_plane else limit.slope[here]
        self.limit, self.slope = limit, slope[:, None] * basis[here]
        self.offset = (limit.slant[here] if limit.half_plane else 1.0) * limit.offset[here] + slope * at[here]
        self.around: tuple[Complex, Complex] | None = None
        if limit.around:
            radius, grows = limit.around[0][here], limit.around[1][here]
            self.around = radius + grows * at[here], grows[:, None] * basis[here]


def _limits(on: Responses, wanted: Wanted, right: tuple[Band, ...]) -> list[Limit]:
    S = on.S
    forward = on.late * on.N
    limits = [Limit("disk margin", S - 0.5, -S * forward, 1.0 / wanted.disk_margin)]
    if wanted.peak is not None:
        limits.append(Limit("peak of the noise", np.zeros_like(S), on.M, wanted.peak))
    if wanted.moment_hz is not None:
        share = missed(on.angles, on.dt, wanted.moment_hz)
        limits.append(Limit(READINGS, np.zeros_like(S), share * S * forward, MISREAD))
    for half in range(2, 2 * wanted.delay_margin + 1):  # half samples between: a delay need not be whole
        late = np.exp(-0.5j * half * on.angles)
        limits.append(Limit(DELAY, np.ones_like(S), -(1.0 - late) * forward, ROOM, half_plane=True))
    if right:
        inside = np.any([(low <= on.angles) & (on.angles <= high) for low, high in right], axis=0)
        limits.append(Limit("zeros of T_f", np.ones_like(S), -1.0 * inside * forward, ROOM, half_plane=True))
    return limits


def _cone_programme(P: Array, q: Array, heard: Array, limits: list[_Watched], trust: Trust | None) -> Answer | None:
    """min y' P y / 2 + q' y, |heard [y; 1]| <= 1, within the limits. None: infeasible."""
    n = len(q)
    rows, sides, cones = [], [], []
    for each in limits:
        count, size = len(each.offset), each.limit.size
        if each.around:
            cone = np.zeros((count, 3, n))
            cone[:, 0], cone[:, 1], cone[:, 2] = -each.slope.real, -each.around[1].real, -each.around[1].imag
            rows.append(cone.reshape(-1, n))
            parts = (each.offset.real - size, each.around[0].real, each.around[0].imag)
            sides.append(np.stack(parts, axis=1).ravel())
            cones += [clarabel.SecondOrderConeT(3)] * count
            continue
        if each.limit.half_plane:
            rows.append(-each.slope.real)
            sides.append(each.offset.real - size)
            cones.append(clarabel.NonnegativeConeT(count))
            continue
        disk = np.zeros((count, 3, n))
        disk[:, 1], disk[:, 2] = -each.slope.real, -each.slope.imag
        rows.append(disk.reshape(-1, n))
        sides.append(np.stack([np.full(count, size), each.offset.real, each.offset.imag], axis=1).ravel())
        cones += [clarabel.SecondOrderConeT(3)] * count
    rows.append(np.vstack([np.zeros(n), -heard[:, :n]]))
    sides.append(np.concatenate([[1.0], heard[:, n]]))
    cones.append(clarabel.SecondOrderConeT(1 + len(heard)))
    if trust:
        rows.append(np.vstack([np.zeros(n), -np.eye(n)[-trust.count :]]))
        sides.append(np.concatenate([[trust.size], np.zeros(trust.count)]))
        cones.append(clarabel.SecondOrderConeT(1 + trust.count))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    answer = clarabel.DefaultSolver(
        sparse.csc_matrix(np.triu(P)), q, sparse.csc_matrix(np.vstack(rows)), np.concatenate(sides), cones, settings
    ).solve()
    if str(answer.status) not in ("Solved", "AlmostSolved"):
        return None
    ends = np.cumsum([len(side) for side in sides])[: len(limits) + 1]
    duals = tuple(float(np.max(np.abs(part), initial=0.0)) for part in np.split(np.array(answer.z), ends)[:-1])
    return Answer(np.array(answer.x), duals)


def _split(values: Complex) -> Array:
    return np.asarray(np.concatenate([values.real, values.imag]))
