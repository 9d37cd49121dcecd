import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from dob_companion.artifact import StateSpaceData
from dob_companion.errors import SpecError
from dob_companion.lti.response import response
from dob_companion.synthesis import synthesize
from dob_companion.synthesis.plant.models import polynomial, to_state_space, zpk
from dob_companion.synthesis.spec.parse import Entries, Matrices, Model, Polynomial, Zpk
from tests.effort import examples
from tests.synthesis.paper import PID, PLANT, W_D, W_N

ANGLES = np.linspace(0.02, 3.1, 40)


def evaluate(zeros, poles, gain, z):
    out = np.full_like(z, gain, dtype=complex)
    for root in zeros:
        out *= z - root
    for root in poles:
        out /= z - root
    return out


def roots(pairs, reals):
    return [*reals, *(complex(*p) for p in pairs), *(complex(p[0], -p[1]) for p in pairs)]


real = st.floats(-0.95, 0.95)
pair = st.tuples(st.floats(-0.9, 0.9), st.floats(0.01, 0.4))


@given(st.lists(pair, max_size=3), st.lists(real, max_size=4), st.lists(pair, max_size=3), st.lists(real, max_size=3))
@settings(max_examples=examples(80), deadline=None)
def test_zpk_has_the_response_of_its_factors(pole_pairs, poles, zero_pairs, zeros):
    p, z = roots(pole_pairs, poles), roots(zero_pairs, zeros)
    if len(z) > len(p):
        return
    system = zpk(z, p, 0.7, 0.01)
    assert system.nstates == len(p)
    expected = evaluate(z, p, 0.7, np.exp(1j * ANGLES))
    assert response(system, ANGLES)[:, 0, 0] == pytest.approx(expected, rel=1e-8, abs=1e-9)


def test_eight_clustered_poles_keep_their_digits():
    poles = [0.99, 0.991, 0.992, 0.993, 0.994, 0.995, 0.996, 0.997]
    system = zpk([], poles, 1.0, 0.01)
    assert sorted(np.linalg.eigvals(system.A).real) == pytest.approx(poles, abs=1e-10)


def test_polynomials_keep_their_coefficients():
    system = polynomial([2.0, 3.0], [2.0, -1.0, 0.5], 0.01)
    z = np.exp(1j * ANGLES)
    assert response(system, ANGLES)[:, 0, 0] == pytest.approx((2 * z + 3) / (2 * z**2 - z + 0.5), rel=1e-13)


def test_a_gain_alone_has_no_states():
    assert zpk([], [], 3.0, 0.01).nstates == 0
    assert polynomial([3.0], [1.0], 0.01).nstates == 0


def test_entries_of_one_column_share_their_poles():
    """Two outputs of one integrator are one state, not two: a copy could not be reached apart."""
    entry = Polynomial((0.1,), (1.0, -1.0))
    model = Model(
        Entries(2, ((0, 0, Model(entry, "a")), (1, 0, Model(entry, "b")), (1, 1, Model(entry, "c")))), "plant"
    )
    system = to_state_space(model, 0.01, (2, 2))
    assert system.nstates == 2
    G = 0.1 / (np.exp(1j * ANGLES) - 1.0)
    expected = G[:, None, None] * np.array([[1.0, 0.0], [1.0, 1.0]])
    assert response(system, ANGLES) == pytest.approx(expected, rel=1e-7, abs=1e-9)


def test_zero_order_hold_of_an_integrator():
    system = to_state_space(Model(Zpk((), (0.0,), 5.0), "plant", "s", "zoh"), 0.02)
    assert response(system, ANGLES)[:, 0, 0] == pytest.approx(0.1 / (np.exp(1j * ANGLES) - 1.0))


@pytest.mark.parametrize("method", ["zoh", "foh", "tustin", "impulse"])
def test_every_named_method_discretizes_at_the_given_rate(method):
    system = to_state_space(Model(Polynomial((1.0,), (1.0, 1.0)), "plant", "s", method), 0.1)
    assert system.dt == pytest.approx(0.1)
    expected = (1 - 0.05) / (1 + 0.05) if method == "tustin" else np.exp(-0.1)
    assert np.linalg.eigvals(system.A) == pytest.approx([expected])


@pytest.mark.parametrize("delay", [0.0, 0.3, 1.0, 1.7, 3.0])
def test_a_delay_of_any_share_of_a_sample_is_exact(delay):
    """Steps of the input, each answered by the model's own response to a step that begins so much later."""
    dt, rng = 0.02, np.random.default_rng(1)
    num, den = (3.0, 20.0, 800.0), (1.0, 12.0, 400.0)
    system = to_state_space(Model(Polynomial(num, den), "plant", "s", "zoh", delay * dt), dt)
    u = rng.standard_normal(40)
    _, found = ct.forced_response(system, inputs=u)
    share, poles, _ = signal.residue(num, [*den, 0.0])  # of the step response
    expected = np.zeros(40)
    for k, step in enumerate(np.diff(u, prepend=0.0)):
        since = (np.arange(40) - k - delay) * dt
        acting = since > -1e-12
        expected[acting] += step * np.real(np.exp(np.outer(since[acting], poles)) @ share)
    assert np.ravel(found) == pytest.approx(expected, abs=1e-9)
    assert system.nstates == 2 + int(np.ceil(delay))


def test_a_delay_is_of_a_held_continuous_model_and_not_endless():
    model = Model(Polynomial((1.0,), (1.0, 0.0)), "plant", "s", "zoh", 0.7)
    with pytest.raises(SpecError, match=r"plant: delay_s: 0.7 s are 35 samples, expected at most 30"):
        to_state_space(model, 0.02)


def test_matrices_come_through_bit_for_bit():
    data = StateSpaceData([[0.1]], [[0.2]], [[0.3]], [[0.4]])
    system = to_state_space(Model(Matrices(((0.1,),), ((0.2,),), ((0.3,),), ((0.4,),)), "plant"), 0.01)
    assert all(np.array_equal(getattr(system, k), getattr(data, k)) for k in "ABCD")
    assert isinstance(system, ct.StateSpace)


def test_transfer_functions_of_python_control_are_taken_as_well():
    systems = (PLANT, PID, W_D, W_N)
    certified = synthesize(*(ct.tf(system) for system in systems)).certificate
    assert certified.gamma_star == pytest.approx(1.59982, rel=1e-3)
