"""The upper bound of mu against SLICOT's AB13MD, and the coupled disk margin against python-control.

Both oracles are given problems in even units: their own search loses its footing in uneven ones.
"""

import control as ct
import numpy as np
import pytest

from dob_companion.synthesis import synthesize
from dob_companion.synthesis.certify.margins import disk_margin
from dob_companion.synthesis.norms.structured import optimal_scales, structured_bounds
from dob_companion.synthesis.plant.estimation import delay
from dob_companion.synthesis.plant.loop import close_loop
from tests.synthesis.problems import DT, random_problem, static

slycot = pytest.importorskip("slycot")


def mu(M):
    k = M.shape[1]
    return np.array([slycot.ab13md(m, np.array([1] * k), np.array([2] * k))[0] for m in M])


@pytest.mark.parametrize("k", [2, 3, 4, 6])
def test_bounds_are_slicots_in_any_units(k):
    rng = np.random.default_rng(k)
    M = (rng.normal(size=(60, k, k)) + 1j * rng.normal(size=(60, k, k))) * 10 ** rng.uniform(-1, 1, size=(60, k, 1))
    M[:10] = np.triu(M[:10])  # coupled one way only: the least bound is not attained
    units = 10.0 ** rng.uniform(-6, 6, size=(60, k))
    uneven = M * units[:, :, None] / units[:, None, :]
    bounds, scales = optimal_scales(uneven, np.ones((60, k)) / units)
    assert bounds == pytest.approx(mu(M), rel=1e-5)
    scaled = uneven * scales[:, :, None] / scales[:, None, :]
    assert np.linalg.norm(scaled, 2, axis=(1, 2)) == pytest.approx(bounds, rel=1e-9)
    every, scales = structured_bounds(uneven)
    assert np.max(every) == pytest.approx(np.max(mu(M)), rel=1e-5)
    assert np.all(every >= mu(M) * (1 - 1e-5))


def test_matrices_that_vanish_have_no_size_and_no_scaling_that_is_not_a_number():
    bounds, scales = structured_bounds(np.zeros((2, 3, 3), dtype=complex))
    assert not np.any(bounds)
    assert np.all(np.isfinite(scales) & (scales > 0))


def loop_gain(plant, controller, observer, delays):
    """L = (1 + z^-tau D_u)^-1 (C + z^-tau D_y) G: the loop broken between the observer's tap and the plant."""
    p, m = plant.D.shape
    late = delay(delays, DT)
    D_y, D_u = late * observer[:, list(range(p))], late * observer[:, list(range(p, p + m))]
    return static(np.eye(m)).feedback(D_u) * (controller + D_y) * plant


@pytest.mark.parametrize(
    ("seed", "p", "delays", "unit"),
    [
        (1, 2, (1, 1), 1.0),
        (2, 2, (1, 1), 1e3),  # units a million apart
        (0, 3, (2, 0, 2), 1.0),
        (3, 3, (2, 0, 2), 1.0),
    ],
)
def test_the_coupled_disk_margin_is_python_controls(seed, p, delays, unit):
    plant, controller, W_d, W_n = random_problem(seed, p, p)
    into = np.diag([1.0 / unit, unit] if p == 2 else [1.0] * p)
    back = static(np.linalg.inv(into))
    result = synthesize(plant * static(into), controller, back * W_d, W_n, delay_samples=delays)
    loop = close_loop(result.problem.plant, result.problem.controller, result.observer, delays)
    even = static(into) * result.observer * static(np.diag([*np.ones(p), *np.diag(back.D)]))
    omega = np.unique(np.concatenate([np.geomspace(1e-2, np.pi / DT, 300), np.linspace(1, np.pi / DT, 300)]))
    expected = ct.disk_margins(loop_gain(plant, controller, even, delays), omega)[0]
    margin = disk_margin(loop)
    assert margin == pytest.approx(expected, rel=3e-3)
    assert margin <= expected * (1 + 1e-9), "the margin holds between python-control's frequencies too"
    assert result.certificate.disk_margin == pytest.approx(margin, rel=1e-4)
    assert min(result.certificate.extra["disk_margin_per_axis"]) >= margin * (1 - 1e-6)
