"""Extended-state observer of active disturbance rejection control, tuned by one bandwidth.

Sources: Z. Gao, "Scaling and bandwidth-parameterization based controller tuning", American Control Conference, 2003
(all observer poles at one place); R. Miklosovic, A. Radke, Z. Gao, "Discrete implementation and generalization of the
extended state observer", American Control Conference, 2006 (poles at exp(-ω₀ T), the current estimator, and known
plant dynamics inside the observer instead of a chain of integrators).

The plant's model is used: a chain of integrators would count the plant's own lag as disturbance, and so take away
from under the baseline controller the plant that it was tuned for. The extended state is constant between samples.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dob_companion.comparison.augmented import Augmented, augment
from dob_companion.comparison.rational import NotApplicableError

Array = NDArray[np.float64]


def extended_state_observer(plant: Any, delay: int, hertz: float) -> Any:
    """D(z) whose n+1 poles all lie at exp(-2π hertz dt).

    Raises NotApplicableError for a plant with a pole at z = 0 (a pure delay), which no current estimator can move.
    """
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
