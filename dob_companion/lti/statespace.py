"""State space as four arrays, and how systems are joined."""

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dob_companion.lti.response import spectral_radius

Array = NDArray[np.float64]

SWEEPS = 8
"""Of balancing; it needs not be at its end, as any units give the same loop."""


class System(Protocol):
    """x(k+1) = A x + B u, y = C x + D u: A (n, n), B (n, m), C (p, n), D (p, m)."""

    @property
    def A(self) -> Any: ...  # noqa: D102
    @property
    def B(self) -> Any: ...  # noqa: D102
    @property
    def C(self) -> Any: ...  # noqa: D102
    @property
    def D(self) -> Any: ...  # noqa: D102


@dataclass(frozen=True, slots=True, eq=False)
class StateSpaceData:
    """x(k+1) = A x + B u, y = C x + D u, as read-only float64 arrays.

    Shapes: A (n, n), B (n, m), C (p, n), D (p, m); n may be 0.
    Raises ValueError when a shape does not fit or a number is not finite.
    """

    A: Array
    B: Array
    C: Array
    D: Array

    def __init__(self, A: ArrayLike, B: ArrayLike, C: ArrayLike, D: ArrayLike) -> None:
        """Copy, check and freeze the four matrices; an empty list stands for a matrix without rows."""
        d = _matrix("D", D)
        p, m = d.shape
        n = len(np.asarray(A, dtype=float))
        for name, value, shape in (("A", A, (n, n)), ("B", B, (n, m)), ("C", C, (p, n))):
            array = _matrix(name, value)
            if array.size == 0 and 0 in shape:
                array = array.reshape(shape)
            if array.shape != shape:
                raise ValueError(f"{name} is {_by(array.shape)}, expected {_by(shape)}")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        d.setflags(write=False)
        object.__setattr__(self, "D", d)

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.A)

    @property
    def spectral_radius(self) -> float:
        """Largest magnitude of the eigenvalues of A; 0 without states."""
        return spectral_radius(self.A)


class ABCD(NamedTuple):
    """Four matrices, unchecked: for loops that are closed by the thousand."""

    A: Array
    B: Array
    C: Array
    D: Array


def static(D: Array) -> ABCD:
    """y = D u."""
    p, m = D.shape
    return ABCD(np.zeros((0, 0)), np.zeros((0, m)), np.zeros((p, 0)), D)


def powers(A: Array, B: Array, count: int) -> Array:
    """B, A B, A^2 B, …: shape (count, n, m)."""
    out = np.empty((count, *B.shape))
    for k in range(count):
        out[k] = B if k == 0 else A @ out[k - 1]
    return out


def series(second: System, first: System) -> ABCD:
    """y = second(first(u))."""
    A = np.block([[second.A, second.B @ first.C], [np.zeros((len(first.A), len(second.A))), first.A]])
    B, C = np.vstack([second.B @ first.D, first.B]), np.hstack([second.C, second.D @ first.C])
    return ABCD(A, B, C, second.D @ first.D)


def added(a: System, b: System) -> ABCD:
    """y = a(u) + b(u)."""
    return ABCD(diagonal(a.A, b.A), np.vstack([a.B, b.B]), np.hstack([a.C, b.C]), a.D + b.D)


def beside(*systems: System) -> ABCD:
    """Each system with its own inputs and outputs, in order."""
    return ABCD(*(diagonal(*(getattr(system, name) for system in systems)) for name in "ABCD"))


def delay_line(samples: int) -> ABCD:
    """z^-samples for one channel."""
    n = samples
    return ABCD(np.eye(n, k=-1), np.eye(n, 1), np.eye(1, n, k=max(n - 1, 0)), np.full((1, 1), float(n == 0)))


def wired(parts: System, inside: Array, outside: Array, read: Array, past: Array) -> ABCD:
    """Parts side by side, inputs v and outputs s, closed around signals w from outside; z is what is read.

    v = inside s + outside w,  z = read s + past w.  The result goes from w to z. An algebraic loop is solved; numpy's
    LinAlgError is raised where it has no solution. Small units alone do not spoil it: v is balanced before.
    """
    n, loop = len(parts.A), inside @ parts.D
    units = _units(loop)[:, None]
    balanced = np.eye(len(loop)) - loop / units * units.T
    v = units * np.linalg.solve(balanced, np.hstack([inside @ parts.C, outside]) / units)
    of_x, of_w = v[:, :n], v[:, n:]
    return ABCD(
        parts.A + parts.B @ of_x,
        parts.B @ of_w,
        read @ (parts.C + parts.D @ of_x),
        read @ parts.D @ of_w + past,
    )


def _units(M: Array) -> Array:
    """Powers of two T for which each row of T^-1 M T is about as large as its column (Osborne, J. ACM 7(4), 1960).

    A row or column of zeros keeps its unit.
    """
    sizes, units = np.abs(M) * (1.0 - np.eye(len(M))), np.ones(len(M))
    both = np.flatnonzero(np.any(sizes, axis=0) & np.any(sizes, axis=1))
    for _ in range(SWEEPS):
        for i in both:
            row, column = sizes[i] @ units / units[i], sizes[:, i] @ (1.0 / units) * units[i]
            units[i] *= np.exp2(np.round(0.5 * np.log2(row / column)))
    return units


def diagonal(*blocks: Array) -> Array:
    """Block-diagonal matrix; blocks need not be square, and may be empty."""
    out = np.zeros((sum(len(M) for M in blocks), sum(M.shape[1] for M in blocks)))
    row = column = 0
    for M in blocks:
        out[row : row + len(M), column : column + M.shape[1]] = M
        row, column = row + len(M), column + M.shape[1]
    return out


def _matrix(name: str, value: ArrayLike) -> NDArray[np.float64]:
    array = np.array(value, dtype=np.float64)
    if array.size == 0 and array.ndim < 2:
        array = array.reshape(0, 0) if array.ndim == 0 else array.reshape(len(array), 0)
    if array.ndim != 2:
        raise ValueError(f"{name} has {array.ndim} dimensions, expected a matrix")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{name} holds a number that is not finite")
    return array


def _by(shape: tuple[int, ...]) -> str:
    return "x".join(str(n) for n in shape)
