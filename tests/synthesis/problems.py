"""Random problems with a stable baseline, for tests that must hold on any of them."""

import control as ct
import numpy as np

from dob_companion.synthesis import zpk
from dob_companion.synthesis.plant.models import stack

DT = 0.004


def static(matrix):
    return ct.ss([], [], [], np.atleast_2d(np.asarray(matrix, dtype=float)), DT)


def random_plant(rng, n, p, m, *, radius=0.95, feedthrough=0.0):
    A = rng.normal(size=(n, n))
    A *= radius / np.max(np.abs(np.linalg.eigvals(A)))
    return ct.ss(A, rng.normal(size=(n, m)), rng.normal(size=(p, n)), feedthrough * rng.normal(size=(p, m)), DT)


def disturbance_weight(rng, m):
    return stack(zpk([-0.9], [rng.uniform(0.98, 0.9995)], 10 ** rng.uniform(-2, 0), DT) for _ in range(m))


def noise_weight(rng, p):
    make = lambda: zpk([rng.uniform(0.9, 0.999)], [rng.uniform(-0.95, 0.5)], 10 ** rng.uniform(-1, 1), DT)  # noqa: E731
    return stack(make() for _ in range(p))


def random_problem(seed, p, m, *, feedthrough=0.0, order=4):
    """(plant, controller, W_d, W_n); the plant is stable, so that no controller at all is a stable baseline."""
    rng = np.random.default_rng(seed)
    plant = random_plant(rng, order, p, m, feedthrough=feedthrough)
    return plant, static(np.zeros((m, p))), disturbance_weight(rng, m), noise_weight(rng, p)
