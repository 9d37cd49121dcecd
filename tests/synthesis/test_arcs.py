"""Bounds over arcs of the unit circle hold for every frequency of the arc, however poles cluster."""

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dob_companion.lti.response import gains, response
from dob_companion.synthesis import zpk
from dob_companion.synthesis.norms.arcs import Arcs, gain_bracket
from tests.effort import examples
from tests.synthesis.problems import random_plant


@st.composite
def systems(draw):
    """Random plants, equal lags and lightly damped modes, in several units."""
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    kind = draw(st.sampled_from(["random", "lags", "modes"]))
    if kind == "random":
        p, m = draw(st.sampled_from([(1, 1), (1, 3), (3, 1), (2, 2), (3, 3)]))
        return random_plant(rng, draw(st.integers(1, 8)), p, m, radius=draw(st.sampled_from([0.5, 0.99, 0.9999])))
    if kind == "lags":
        return zpk([], [0.95] * draw(st.integers(2, 8)), 1e-6, 0.004)
    poles = [(1 - 10.0 ** rng.uniform(-5, -2)) * np.exp(1j * rng.uniform(0.1, 3.0)) for _ in range(2)]
    return zpk([0.5], [*poles, *np.conj(poles)], 10.0 ** rng.uniform(-3, 3), 0.004)


@given(systems(), st.floats(0.0, np.pi), st.floats(-6.0, 0.0), st.booleans())
@settings(max_examples=examples(150), deadline=None, derandomize=True)
def test_no_gain_on_an_arc_exceeds_its_ceiling(system, middle, log_half, scaled):
    half = 10.0**log_half
    rng = np.random.default_rng(1)
    d = 10.0 ** rng.uniform(-2, 2, system.D.shape[1]) if scaled and len(set(system.D.shape)) == 1 else None
    scaling = None if d is None else lambda M, _: np.tile(d, (len(M), 1))
    ceiling, rounding = Arcs.around(system, np.array([middle]), np.array([half]), scaling).ceilings()
    G = response(system, middle + half * np.linspace(-1.0, 1.0, 201))
    sizes = np.linalg.norm(G if d is None else G * d[:, None] / d, 2, axis=(1, 2))
    assert np.max(sizes) <= (ceiling + rounding)[0] * (1 + 1e-12)


@given(systems())
@settings(max_examples=examples(40), deadline=None, derandomize=True)
def test_the_bracket_holds_the_peak_of_a_dense_grid_and_is_narrow(system):
    found = gain_bracket(system, 1e-9)
    assert found.converged
    assert found.low == pytest.approx(gains(system, np.array([found.angle]))[0], rel=1e-9)
    poles = np.angle(system.poles())
    marks = [p + np.concatenate([-w, w]) for p in poles for w in [np.geomspace(1e-7, 0.1, 60)]]
    angles = np.concatenate([np.geomspace(1e-7, np.pi, 3000), np.linspace(0, np.pi, 3000), *marks])
    assert np.max(gains(system, angles)) <= (found.high + found.rounding) * (1 + 1e-12)
    assert found.low <= found.high <= found.low * (1 + 1.01e-9)


def test_the_allowance_for_rounding_covers_what_another_realization_of_the_same_system_computes():
    """Eight equal lags as a product of sections, and in coordinates in which rounding hurts."""
    system = zpk([], [0.95] * 8, 0.05**8, 0.004)
    T = np.random.default_rng(0).normal(size=(8, 8))
    turned = ct.ss(np.linalg.solve(T, system.A @ T), np.linalg.solve(T, system.B), system.C @ T, system.D, system.dt)
    found = gain_bracket(turned, 1e-9)
    assert abs(found.low - 1.0) <= found.rounding  # its peak is at z = 1
    assert 1e-7 < found.rounding < 1e-3


def test_a_pole_on_the_circle_has_no_bound():
    assert gain_bracket(ct.ss([[1.0]], [[1.0]], [[1.0]], [[0.0]], 1.0), 1e-9).high == np.inf
