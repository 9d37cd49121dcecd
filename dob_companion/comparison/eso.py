"""Extended-state observer of active disturbance rejection control, tuned by one bandwidth.

Sources: Z. Gao, "Scaling and bandwidth-parameterization based controller tuning", American Control Conference, 2003
(all observer poles at one place); R. Miklosovic, A. Radke, Z. Gao, "Discrete implementation and generalization of the
extended state observer", American Control Conference, 2006 (poles at exp(-ω₀ T), the current estimator, and known
plant dynamics inside the observer instead of a chain of integrators).

Two forms: around the plant's model, and around a chain of as many integrators as the plant has poles (Gao), which
counts the plant's own lags as disturbance. The extended state is constant between samples.
"""

from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray

from dob_companion.comparison.augmented import Augmented, augment
from dob_companion.comparison.rational import NotApplicableError, roots_of

Array = NDArray[np.float64]

SLOW = 0.3
"""Poles within this distance of z = 1 count as slow: below about a twentieth of the rate."""


def extended_state_observer(plant: Any, delay: int, hertz: float) -> Any:
    """D(z) whose n+1 poles all lie at exp(-2π hertz dt).

    Raises NotApplicableError for a plant with a pole at z = 0 (a pure delay), which no current estimator can move.
    """
    return _observer(plant, delay, hertz)


def integrator_chain_observer(plant: Any, delay: int, hertz: float) -> Any:
    """The same around b_0 / s^n, n the number of the plant's poles and b_0 its gain at frequencies far above them.

    Raises NotApplicableError for a plant whose poles are not all slow beside the rate.
    """
    return _observer(integrator_chain(plant), delay, hertz)


def integrator_chain(plant: Any) -> Any:
    """b_0 / s^n sampled with a zero-order hold: what the plant looks like where its poles are slow."""
    g, dt = roots_of(plant), float(plant.dt)
    if np.max(np.abs(g.poles - 1.0)) > SLOW:
        raise NotApplicableError("the chain of integrators needs a plant of slow poles only")
    n = len(g.poles)
    gain = float(np.real(g.gain * np.prod(1.0 - g.inner) * np.prod(1.0 - g.outer))) / dt**n
    chain = ct.ss(np.eye(n, k=1), gain * np.eye(n, 1, k=1 - n), np.eye(1, n), [[0.0]])
    return ct.sample_system(chain, dt, method="zoh")


def _observer(plant: Any, delay: int, hertz: float) -> Any:
    model = augment(plant, 1.0)
    return model.observer(placed_gain(model, float(np.exp(-2.0 * np.pi * hertz * model.dt))), delay)


def placed_gain(model: Augmented, pole: float) -> Array:
    """Correction gain M (n+1, 1) that puts all eigenvalues of A (I - M C) at `pole`: Ackermann on the pair (A, C A)."""
    n = len(model.A)
    if np.min(np.abs(np.linalg.eigvals(model.A))) < 1e-9:
        raise NotApplicableError("the current estimator needs a plant without a pole at z = 0")
    row, rows = model.C @ model.A, []
    for _ in range(n):
        rows.append(row)
        row = row @ model.A
    wanted = np.linalg.matrix_power(model.A - pole * np.eye(n), n)
    return np.asarray(wanted @ np.linalg.solve(np.vstack(rows), np.eye(n, 1, k=1 - n)))
