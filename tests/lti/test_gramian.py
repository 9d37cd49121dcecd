"""Steady states come to rest, or there is no number."""

import numpy as np
import pytest

from dob_companion.errors import NotConvergedError
from dob_companion.lti.gramian import gramian, gramian_root, predictor


@pytest.mark.parametrize("pole", [1.0, 1.001, -1.5, 1e200])
def test_a_system_that_is_not_stable_has_no_gramian(pole):
    for found in (gramian, gramian_root):
        with pytest.raises(NotConvergedError, match="covariance of a system of order 1 does not come to rest"):
            found(np.array([[pole]]), np.ones((1, 1)))


@pytest.mark.parametrize("pole", [0.0, 0.5, -0.999999, 1 - 1e-9])
def test_a_gramian_is_that_of_the_sum_however_slow_the_mode(pole):
    P = gramian(np.array([[pole]]), np.ones((1, 1)))
    assert P[0, 0] == pytest.approx(
        1.0 / ((1 - pole) * (1 + pole)), rel=1e-6
    )  # rounding of the pole counts for as much


def test_a_root_keeps_what_the_sum_has_rounded_away():
    """Two states that one input moves almost alike: det P = (a - b)^2 / ((1 - a^2) (1 - b^2) (1 - a b)^2)."""
    a, b = 0.9, 0.9 + 1e-8
    L = gramian_root(np.diag([a, b]), np.ones((2, 1)))
    assert np.triu(L, 1) == pytest.approx(0.0)
    assert pytest.approx(gramian(np.diag([a, b]), np.ones((2, 1)))) == L @ L.T
    apart = (b - a) ** 2 / ((1 - a * a) * (1 - b * b) * (1 - a * b) ** 2)
    assert np.linalg.det(L) ** 2 == pytest.approx(apart, rel=1e-5)


def test_a_mode_that_grows_unseen_has_no_predictor():
    A, unseen = np.diag([0.5, 1.5]), np.array([[1.0, 0.0]])
    with pytest.raises(NotConvergedError, match="predictor of a system of order 2 does not come to rest"):
        predictor(A, unseen, np.eye(2, 3), np.array([[0.0, 0.0, 1.0]]))


def test_a_predictor_is_kalmans():
    """Scalar: P = a^2 P - (a P)^2 / (P + r) + q, and K = a P / (P + r)."""
    a, q, r = 1.1, 0.3, 0.7
    half = (r * (a * a - 1) + q) / 2.0
    P = half + np.sqrt(half**2 + q * r)
    K, _ = predictor(np.array([[a]]), np.eye(1), np.array([[np.sqrt(q), 0.0]]), np.array([[0.0, np.sqrt(r)]]))
    assert K[0, 0] == pytest.approx(a * P / (P + r), rel=1e-6)
