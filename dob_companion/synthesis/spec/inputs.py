"""What `synthesize` was given, checked before anything is computed: each refusal names the argument."""

from collections.abc import Sequence
from numbers import Integral, Real
from typing import Any

import control as ct
import numpy as np

from dob_companion.errors import SpecError
from dob_companion.synthesis.spec.uncertainty import Uncertainty
from dob_companion.toml import shown


def discrete_system(value: Any, name: str) -> Any:
    """A StateSpace of `value`, a discrete system of python-control.

    Raises SpecError for anything else: a bare number, continuous time, no sample time, entries that are not finite.
    """
    if not isinstance(value, ct.StateSpace | ct.TransferFunction):
        given = f"{shown(value)} is a number" if isinstance(value, Real) else f"got {type(value).__name__}"
        raise SpecError(
            f"{name}: {given}, expected a discrete StateSpace or TransferFunction of python-control "
            "(a constant k is ct.ss([], [], [], k, dt))"
        )
    if value.dt == 0 and not isinstance(value.dt, bool):
        raise SpecError(
            f"{name}: continuous (dt is 0), expected discrete: ct.sample_system(system, 0.004, method='zoh') at 250 Hz"
        )
    if isinstance(value.dt, bool) or not isinstance(value.dt, Real) or not 0.0 < float(value.dt) < np.inf:
        raise SpecError(f"{name}: dt is {value.dt}, expected its sample time in s")
    try:
        system = ct.ss(value)
    except (ValueError, ct.ControlMIMONotImplemented) as problem:
        raise SpecError(f"{name}: has no state space: {' '.join(str(problem).split())}") from None
    if not all(np.all(np.isfinite(matrix)) for matrix in (system.A, system.B, system.C, system.D)):
        raise SpecError(f"{name}: holds a number that is not finite")
    return system


def link_delays(value: Any, moments: int) -> tuple[int, ...]:
    """The delay of each moment, from one for all or one each. Raises SpecError for what is no whole number."""
    several = isinstance(value, Sequence | np.ndarray) and not isinstance(value, str)
    listed = list(value) if several else [value] * moments
    if not all(isinstance(item, Integral) and not isinstance(item, bool) for item in listed):
        raise SpecError(f"delay_samples: {shown(value)}, expected a whole number, as 1, or one for each moment")
    return tuple(map(int, listed))


def require_options(
    moments: int, gamma_backoff: Any, axes: Any, uncertainty: Any, largest_order: Any
) -> tuple[str, ...] | None:
    """The axes as a tuple. Raises SpecError for an option that is not what `synthesize` says of it."""
    if not (isinstance(gamma_backoff, Real) and 1.0 < float(gamma_backoff) <= 10.0):
        raise SpecError(f"gamma_backoff: {shown(gamma_backoff)}, expected a number above 1, at most 10")
    if largest_order is not None and not (isinstance(largest_order, Integral) and int(largest_order) >= 1):
        raise SpecError(f"largest_order: {shown(largest_order)}, expected a whole number of 1 or more")
    if uncertainty is not None and not isinstance(uncertainty, Uncertainty):
        raise SpecError(f"uncertainty: got {type(uncertainty).__name__}, expected an Uncertainty")
    if uncertainty is not None and len(uncertainty.channels) != moments:
        raise SpecError(f"uncertainty: {len(uncertainty.channels)} channels, expected {moments}, one a moment")
    if axes is None:
        return None
    names = tuple(axes) if isinstance(axes, Sequence) and not isinstance(axes, str) else (axes,)
    if len(names) != moments or not all(isinstance(name, str) and name for name in names):
        raise SpecError(f"axes: {shown(axes)}, expected a name for each of {moments} moments")
    return names
