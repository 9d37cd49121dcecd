"""Joining systems: the same whatever the units, and refused where the algebraic loop has no solution."""

import numpy as np
import pytest

from dob_companion.lti.filters import butterworth
from dob_companion.lti.response import response
from dob_companion.lti.statespace import ABCD, added, beside, delay_line, series, static, wired

ANGLES = np.array([0.0, 0.1, 1.0, 3.0])


def system(seed, p=2, m=2, n=3):
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n))
    return ABCD(
        0.5 * A / np.linalg.norm(A, 2), rng.normal(size=(n, m)), rng.normal(size=(p, n)), rng.normal(size=(p, m))
    )


def at(joined):
    return response(joined, ANGLES)


def test_series_and_sum_are_product_and_sum_of_the_responses():
    a, b = system(1), system(2)
    assert at(series(a, b)) == pytest.approx(at(a) @ at(b), abs=1e-12)
    assert at(added(a, b)) == pytest.approx(at(a) + at(b), abs=1e-12)
    assert at(series(static(2.0 * np.eye(2)), a)) == pytest.approx(2.0 * at(a), abs=1e-12)


@pytest.mark.parametrize("unit", [1.0, 1e8, 1e-8])
def test_a_loop_of_direct_terms_is_closed_to_rounding_in_whatever_units(unit):
    """s1 = a (w - s2), s2 = b s1: the loop is a / (1 + b a) whatever the unit of s1."""
    a, b = system(3), system(4)
    scaled = beside(series(static(unit * np.eye(2)), a), series(b, static(np.eye(2) / unit)))
    one, none = np.eye(2), np.zeros((2, 2))
    inside, outside = np.block([[none, -one], [one, none]]), np.vstack([one, none])
    closed = wired(scaled, inside, outside, np.hstack([one / unit, none]), none)
    expected = at(a) @ np.linalg.inv(one + at(b) @ at(a))
    assert at(closed) == pytest.approx(expected, rel=1e-12, abs=1e-12 * np.max(np.abs(expected)))


def test_an_algebraic_loop_without_solution_is_refused():
    one = np.eye(1)
    with pytest.raises(np.linalg.LinAlgError):
        wired(static(one), one, one, one, 0.0 * one)


@pytest.mark.parametrize("samples", [0, 1, 4])
def test_a_delay_line_delays(samples):
    assert at(delay_line(samples))[:, 0, 0] == pytest.approx(np.exp(-1j * samples * ANGLES), abs=1e-12)


@pytest.mark.parametrize("high_pass", [False, True])
def test_a_butterworth_filter_passes_half_the_power_at_its_cutoff(high_pass):
    dt, hertz = 0.004, 12.0
    gains = np.abs(
        response(butterworth(dt, hertz, high_pass=high_pass), 2 * np.pi * dt * np.array([1e-3, hertz, 125.0]))
    )
    assert gains[:, 0, 0] == pytest.approx([0.0, 0.5**0.5, 1.0][:: 1 if high_pass else -1], abs=1e-6)
