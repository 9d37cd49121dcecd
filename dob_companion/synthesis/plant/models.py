"""From a model as written (zeros and poles, polynomials, matrices, transfer matrix) to discrete state space.

zpk models are realized as a cascade of first- and second-order sections, never through expanded
polynomials, so that every root keeps the digits it was given with.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import linalg

from dob_companion.artifact import StateSpaceData
from dob_companion.errors import SpecError
from dob_companion.synthesis.plant.held_back import held_back
from dob_companion.synthesis.plant.minimal import minimal
from dob_companion.synthesis.plant.solvability import require_sampled_fast_enough
from dob_companion.synthesis.spec.limits import LONGEST_DELAY
from dob_companion.synthesis.spec.parse import Entries, Matrices, Model, Polynomial, Weight, Zpk

Array = NDArray[np.float64]

UNEVEN = 1e3
"""Entry of a discrete A at most; in good coordinates they are of the order of 1."""


def to_state_space(model: Model, dt: float, shape: tuple[int, int] | None = None) -> Any:
    """Discrete python-control StateSpace of a model; `shape` (outputs, inputs) is checked when given.

    Raises SpecError that names the place when matrices do not fit together or the shape differs, and
    UnsolvableError when a continuous mode is too fast for the rate.
    """
    system = _realize(model, 0.0 if model.domain == "s" else dt)
    if shape is not None and system.D.shape != shape:
        raise SpecError(
            f"{model.where}: has {system.D.shape[0]} outputs and {system.D.shape[1]} inputs, "
            f"expected {shape[0]} and {shape[1]}"
        )
    if model.domain == "z":
        return system
    require_sampled_fast_enough(system, dt, model.where)
    if model.method == "impulse" and np.any(system.D):
        raise SpecError(
            f"{model.where}: method: impulse takes models with more poles than zeros only, expected another"
        )
    if model.delay_s > LONGEST_DELAY * dt:
        raise SpecError(
            f"{model.where}: delay_s: {model.delay_s:g} s are {model.delay_s / dt:.0f} samples, expected at most "
            f"{LONGEST_DELAY}"
        )
    return discretize(system, dt, model.method, model.delay_s)


def weight_to_state_space(weight: Weight, dt: float, channels: int) -> Any:
    """A weighting filter over `channels` channels, (channels, any number of inputs)."""
    own = {index: to_state_space(model, dt, (1, 1)) for index, model in weight.own}
    if weight.common is None:
        return stack(own[i] for i in range(channels))
    common = to_state_space(weight.common, dt)
    outputs, inputs = common.D.shape
    if (outputs, inputs) == (1, 1):
        return stack(own.get(i, common) for i in range(channels))
    if outputs != channels or own:
        raise SpecError(
            f"{weight.where}: has {outputs} outputs and {inputs} inputs, expected 1 and 1 (for each channel) "
            f"or {channels} outputs for all channels at once"
        )
    return common


def from_data(data: StateSpaceData, dt: float) -> Any:
    """python-control's form of stored matrices."""
    return ct.ss(data.A, data.B, data.C, data.D, dt)


def to_data(system: Any) -> StateSpaceData:
    """Stored form of a python-control system."""
    return StateSpaceData(system.A, system.B, system.C, system.D)


def stack(systems: Any) -> Any:
    """Block-diagonal arrangement of systems."""
    systems = list(systems)
    return systems[0] if len(systems) == 1 else ct.append(*systems)


def discretize(system: Any, dt: float, method: str, delay_s: float = 0.0) -> Any:
    """Continuous to discrete at dt (s) by a named method (spec.METHODS), in the same coordinates.

    With "zoh" every input may act `delay_s` late; the delay's states come after those of the system.

    On the way the states are scaled by powers of two, which rounds nothing: without it the matrix exponential of a
    companion form of order 8 keeps four digits. They stay scaled where the entries of A would otherwise exceed
    UNEVEN, with which no loop around the system could be measured.
    """
    if system.nstates == 0 and not delay_s:
        return ct.ss([], [], [], system.D, dt)
    system = ct.ss(system)
    unit = np.ones(0)
    if system.nstates:
        _, (unit, _) = linalg.matrix_balance(system.A, permute=False, separate=True)
    even = ct.ss(system.A * unit / unit[:, None], system.B / unit[:, None], system.C * unit, system.D, system.dt)
    d = held_back(even, dt, delay_s) if delay_s else ct.sample_system(even, dt, method=method)
    unit = np.concatenate([unit, np.ones(d.nstates - len(unit))])
    if np.max(np.abs(d.A * unit[:, None] / unit)) > UNEVEN:
        return d
    return ct.ss(d.A * unit[:, None] / unit, d.B * unit[:, None], d.C / unit, d.D, dt)


def _realize(model: Model, dt: float) -> Any:
    match model.form:
        case Zpk(zeros, poles, gain):
            return zpk(zeros, poles, gain, dt)
        case Polynomial(num, den):
            return polynomial(num, den, dt)
        case Matrices():
            return _matrices(model.where, model.form, dt)
        case Entries(size, items):
            return _transfer_matrix(size, items, dt)


def _matrices(where: str, form: Matrices, dt: float) -> Any:
    try:
        return from_data(StateSpaceData(form.A, form.B, form.C, form.D), dt)
    except ValueError as problem:
        raise SpecError(f"{where}: {problem}") from None


def _transfer_matrix(size: int, items: Sequence[tuple[int, int, Model]], dt: float) -> Any:
    """Entries side by side; poles that entries share are then merged by minimal realization."""
    parts = [_realize(model, dt) for _, _, model in items]
    left, right = np.zeros((size, len(parts))), np.zeros((len(parts), size))
    for k, (to, source, _) in enumerate(items):
        left[to, k] = right[k, source] = 1.0
    whole = stack(parts)
    return minimal(ct.ss(whole.A, whole.B @ right, left @ whole.C, left @ whole.D @ right, dt))


def polynomial(num: ArrayLike, den: ArrayLike, dt: float) -> Any:
    """num/den as a controllable companion form with exactly these coefficients."""
    a, b = np.asarray(den, dtype=float), np.asarray(num, dtype=float)
    a, b = a / a[0], np.concatenate([np.zeros(len(a) - len(b)), b]) / a[0]
    n = len(a) - 1
    A, B = np.eye(n, k=-1), np.eye(n, 1)
    A[:1] = -a[1:]
    return ct.ss(A, B, (b[1:] - b[0] * a[1:]).reshape(1, n), [[b[0]]], dt)


def zpk(zeros: Sequence[complex], poles: Sequence[complex], gain: float, dt: float) -> Any:
    """gain * prod(z - zeros) / prod(z - poles) as a cascade of sections of order 1 and 2."""
    cascade = ct.ss([], [], [], [[gain]], dt)
    for num, den in _pair(_factors(zeros), _factors(poles)):
        cascade = _section(num, den, dt) * cascade
    return cascade


def _factors(roots: Sequence[complex]) -> list[tuple[complex, ...]]:
    """Roots in twos, conjugates together; one real root stays alone when their number is odd."""
    real = sorted((complex(r) for r in roots if r.imag == 0), key=abs)
    odd = len(real) % 2
    out: list[tuple[complex, ...]] = [(r,) for r in real[:odd]]
    out += zip(real[odd::2], real[odd + 1 :: 2], strict=True)
    return out + [(r, r.conjugate()) for r in roots if r.imag > 0]


def _pair(nums: list[tuple[complex, ...]], dens: list[tuple[complex, ...]]) -> Iterator[Any]:
    """Give each denominator the nearest numerator that fits, the most resonant denominator first."""
    left = list(nums)
    for den in sorted(dens, key=lambda roots: (-len(roots), -max(map(abs, roots)))):
        fitting = [num for num in left if len(num) <= len(den)]
        longest = max(map(len, fitting), default=0)
        choice = [num for num in fitting if len(num) == longest]
        best = min(choice, key=lambda num: min(abs(zero - den[-1]) for zero in num), default=())
        if best:
            left.remove(best)
        yield best, den


def _section(num: tuple[complex, ...], den: tuple[complex, ...], dt: float) -> Any:
    """prod(z - num) / prod(z - den) of order 1 or 2, with the roots themselves standing in A."""
    b = np.concatenate([np.zeros(len(den) - len(num)), np.real(np.poly(num)) if num else np.ones(1)])
    if len(den) == 1:
        return ct.ss([[den[0].real]], [[1.0]], [[b[1] + b[0] * den[0].real]], [[b[0]]], dt)
    p, q = den
    slope, rest = b[1] + b[0] * (p + q).real, b[2] - b[0] * (p * q).real  # what is left above den after b[0]
    if p.imag == 0:  # x1 = u / (z - p), x2 = x1 / (z - q)
        return ct.ss([[p.real, 0], [1, q.real]], [[1], [0]], [[slope, rest + slope * q.real]], [[b[0]]], dt)
    A = [[p.real, -(p.imag**2)], [1, p.real]]
    return ct.ss(A, [[1], [0]], [[slope, rest + slope * p.real]], [[b[0]]], dt)
