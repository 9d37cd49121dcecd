"""Whatever stable plant comes: a certified observer. Units, delays, feedthrough and shape are drawn at random."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dob_companion.errors import UnsolvableError
from dob_companion.lti.response import spectral_radius
from dob_companion.synthesis import synthesize, zpk
from dob_companion.synthesis.plant.models import stack
from tests.synthesis.problems import DT, random_plant, static

logs = st.floats(-3.0, 3.0)


@st.composite
def problems(draw):
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    p, m = draw(st.sampled_from([(1, 1), (1, 1), (2, 1), (2, 2), (3, 2), (1, 2)]))
    radius = draw(st.sampled_from([0.3, 0.9, 0.99, 0.999]))
    plant = random_plant(
        rng, draw(st.integers(1, 4)), p, m, radius=radius, feedthrough=draw(st.sampled_from([0.0, 1.0]))
    )
    into, out = (np.diag([10.0 ** draw(logs) for _ in range(k)]) for k in (m, p))
    W_d = stack(
        zpk([draw(st.floats(-1.0, 0.9))], [1 - 10.0 ** draw(st.floats(-4.0, -1.0))], 0.1, DT) * (1.0 / into[i, i])
        for i in range(m)
    )
    W_n = stack(
        zpk([draw(st.floats(0.5, 0.999))], [draw(st.floats(-0.95, 0.5))], 10.0 ** draw(st.floats(-2.0, 1.0)), DT)
        * out[i, i]
        for i in range(p)
    )
    delays = tuple(draw(st.integers(0, 3)) for _ in range(m))
    return static(out) * plant * static(into), static(np.zeros((m, p))), W_d, W_n, delays


@given(problems(), st.sampled_from([1.01, 1.001]))
@settings(max_examples=12, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
def test_a_stable_plant_always_gets_a_certified_observer(problem, backoff):
    *systems, delays = problem
    p = systems[0].D.shape[0]
    result = synthesize(*systems, delay_samples=delays, gamma_backoff=backoff)
    proof = result.certificate
    assert 0.0 < proof.gamma_star * (1 - 1e-6) <= proof.gamma <= backoff * proof.gamma_star
    assert proof.command_leak < 1e-6
    assert proof.observer_spectral_radius < 1.0
    assert proof.closed_loop_spectral_radius < 1.0
    assert not np.any(result.observer.D[:, p:])


@given(st.integers(0, 10**6), st.floats(-3.0, 3.0))
@settings(max_examples=15, deadline=None, derandomize=True)
def test_any_gain_around_any_plant_is_certified_or_refused_in_one_line(seed, gain):
    """Unstable plants and loops included: an answer with a proof, or the reason."""
    rng = np.random.default_rng(seed)
    plant = random_plant(rng, 3, 1, 1, radius=rng.choice([0.9, 1.0, 1.1]))
    weights = zpk([-0.9], [0.99], 0.1, DT), zpk([0.99], [-0.9], 1.0, DT)
    if spectral_radius((plant * gain).feedback(static(1.0)).A) < 1.0 - 1e-9:
        proof = synthesize(plant, static(gain), *weights).certificate
        assert proof.gamma <= 1.01 * proof.gamma_star
        return
    with pytest.raises(
        UnsolvableError, match=r"^baseline loop of input 1 .* is not stable: mode z = .* (grows by|neither)"
    ) as refusal:
        synthesize(plant, static(gain), *weights)
    assert "\n" not in str(refusal.value)
