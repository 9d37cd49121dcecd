import control as ct
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import linalg

from dob_companion.errors import NotConvergedError
from dob_companion.lti.gramian import gramian
from dob_companion.lti.response import gains, response
from dob_companion.synthesis import synthesize, zpk
from dob_companion.synthesis.norms import arcs
from dob_companion.synthesis.norms.hinf import hinf_norm
from dob_companion.synthesis.plant.minimal import hidden_modes, minimal
from tests.synthesis import exact
from tests.synthesis.problems import DT, static

slycot = pytest.importorskip("slycot")


def random_system(rng, radius=0.9, n=None):
    n = n or int(rng.integers(1, 14))
    p, m = rng.integers(1, 4, 2)
    A = rng.normal(size=(n, n))
    A *= radius / np.max(np.abs(np.linalg.eigvals(A)))
    B = rng.normal(size=(n, m)) * 10.0 ** rng.uniform(-3, 3, size=m)
    C = rng.normal(size=(p, n)) * 10.0 ** rng.uniform(-3, 3, size=(p, 1))
    return ct.ss(A, B, C, rng.normal(size=(p, m)) * rng.integers(0, 2), 0.01)


@pytest.mark.parametrize("radius", [0.5, 0.9, 0.999, 0.99999])
def test_norm_agrees_with_slicot(radius):
    rng = np.random.default_rng(int(1e5 * radius))
    for _ in range(15):
        s = random_system(rng, radius)
        n, (p, m) = s.nstates, s.D.shape
        expected = slycot.ab13dd("D", "I", "N", "D", n, m, p, s.A, np.eye(n), s.B, s.C, s.D, tol=1e-12)[0]
        value, angle = hinf_norm(s)
        assert value == pytest.approx(expected, rel=1e-8)
        assert gains(s, np.array([angle]))[0] == pytest.approx(value, rel=1e-8)


def test_norm_of_a_lightly_damped_mode_is_found_between_grid_points():
    damping, turn = 1e-6, 1.2345678
    A = (1 - damping) * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    value, angle = hinf_norm(ct.ss(A, [[1.0], [0.0]], [[1.0, 0.0]], [[0.0]], 1.0))
    assert value == pytest.approx(0.5 / damping, rel=1e-3)
    assert angle == pytest.approx(turn, abs=1e-6)


def test_norm_of_a_delay_is_one_and_of_an_unstable_system_infinite():
    assert hinf_norm(ct.ss([[0.0]], [[1.0]], [[1.0]], [[0.0]], 1.0))[0] == pytest.approx(1.0)
    assert hinf_norm(ct.ss([[1.0]], [[1.0]], [[1.0]], [[0.0]], 1.0))[0] == np.inf
    assert hinf_norm(ct.ss([], [], [], [[3.0, 4.0]], 1.0))[0] == pytest.approx(5.0)
    assert hinf_norm(ct.ss([[0.5]], [[1.0]], [[0.0]], [[0.0]], 1.0))[0] == 0.0


def test_gramian_solves_its_equation():
    s = random_system(np.random.default_rng(1), 0.999, 8)
    P = gramian(s.A, s.B)
    assert pytest.approx(linalg.solve_discrete_lyapunov(s.A, s.B @ s.B.T), rel=1e-6) == P
    assert pytest.approx(P, rel=1e-9) == s.A @ P @ s.A.T + s.B @ s.B.T


@pytest.mark.parametrize("hidden", [0.3, 0.99, 1.0, 1.2])
def test_hidden_modes_are_found_and_removed_whatever_their_place(hidden):
    rng = np.random.default_rng(5)
    s = random_system(rng, 0.95, 5)
    T = rng.normal(size=(7, 7))
    A = linalg.block_diag(s.A, hidden, 0.5)
    A[5, :5] = rng.normal(size=5)  # 5 is reached but not seen, 6 seen but not reached
    B = np.vstack([s.B, rng.normal(size=(1, s.B.shape[1])), np.zeros((1, s.B.shape[1]))])
    C = np.hstack([s.C, np.zeros((len(s.C), 1)), rng.normal(size=(len(s.C), 1))])
    big = ct.ss(T @ A @ np.linalg.inv(T), T @ B, C @ np.linalg.inv(T), s.D, s.dt)
    small = minimal(big)
    assert small.nstates == 5
    angles = np.linspace(0.0, np.pi, 50)
    G = response(s, angles)
    assert np.max(np.abs(response(small, angles) - G) / np.max(np.abs(G), axis=0)) < 1e-7
    assert sorted(hidden_modes(big).real) == pytest.approx(sorted([hidden, 0.5]), abs=1e-5)


def test_a_minimal_system_is_left_bit_for_bit():
    s = random_system(np.random.default_rng(2), 0.9, 6)
    assert minimal(s) is s


def test_a_zero_that_nearly_takes_back_a_pole_leaves_the_system_as_it_is():
    """W_d of a best observer; a root of its Gramian, not of the sum, keeps the digits of both."""
    slow, fast, near = 0.9907 + 0.01125j, 0.8767 + 0.0563j, -0.00096 + 0.01285j
    zeros = [-0.9902155, 0, 0, 0.80445, 0.99202, 0.9772 + 0.0889j, 0.9772 - 0.0889j]
    poles = [-0.9902178, *(w for v in (slow, fast, near) for w in (v, v.conjugate()))]
    left_as_it_is(zpk(zeros, poles, 0.99, DT))


@given(
    st.lists(st.floats(-0.999, 0.999), min_size=2, max_size=7),
    st.lists(st.floats(-7.0, -1.0), min_size=7, max_size=7),
)
def test_what_is_minimal_answers_as_the_whole_does(poles, distances):
    zeros = [p + 10.0**d for p, d in zip(poles, distances, strict=False)]
    left_as_it_is(zpk(zeros, poles, 1.0, DT))


def left_as_it_is(system):
    small = minimal(system)
    angles = np.concatenate([np.geomspace(1e-5, 0.1, 100), np.linspace(0.1, np.pi, 300)])
    G = response(system, angles)
    assert np.max(np.abs(response(small, angles) - G)) < 1e-6 * np.max(np.abs(G))
    assert np.max(np.abs(np.linalg.eigvals(small.A)), initial=0.0) < 1.0


LAGS = {"controller": 1.0, "W_d": ([-0.8997], [0.9962], 0.19908), "W_n": ([0.9949], [-0.925], 3.7584)}


@pytest.mark.parametrize("lags", [2, 5, 6])
def test_peaks_of_designs_for_equal_lags_are_those_of_sixty_digits(lags):
    """(0.05 / (z - 0.95))^lags with the paper's weights: poles of the loop cluster, and so do rounding's effects."""
    roots = [], [0.95] * lags, 0.05**lags
    weights = [zpk(*LAGS[name], DT) for name in ("W_d", "W_n")]
    result = synthesize(zpk(*roots, DT), static(LAGS["controller"]), *weights)
    parts = [exact.factored(*part) for part in (roots, LAGS["W_d"], LAGS["W_n"])]
    gains = exact.loop_gains(parts[0], lambda _: exact.Complex(LAGS["controller"]), result.observer, 1, *parts[1:])
    error, margin, noise = exact.peaks(gains, [1e-12, *np.geomspace(1e-3, np.pi - 1e-6, 25)])
    proof = result.certificate
    found = np.array([proof.gamma, 1.0 / proof.disk_margin, proof.extra["noise_to_estimate_peak"]])
    true = np.array([error, margin, noise])
    assert np.all(found >= true)
    assert found == pytest.approx(true, rel=3e-9)


def test_a_plant_with_a_resonance_and_slow_weights_of_third_order_is_certified():
    """Integrator with lag, a mode at 139 Hz, four samples of delay, a disturbance weight of three lags."""
    turn = 2 * np.pi * 139 * DT
    mode = 0.98 * np.exp(1j * turn)
    size = abs(1 - mode) ** 2
    plant = zpk([], [1.0, 0.9, mode, mode.conjugate()], 0.1 * size * 0.3, DT)
    W_d = zpk([], [0.99, 0.985, 0.98], 0.01 * 0.015 * 0.02 * 30.0, DT)
    result = synthesize(plant, static(0.02), W_d, zpk([0.99], [-0.9], 1.0, DT), delay_samples=4)
    assert result.certificate.gamma <= 1.01 * result.certificate.gamma_star


def test_a_norm_that_cannot_be_bounded_is_an_error_and_not_a_number(monkeypatch):
    monkeypatch.setattr(arcs, "MOST_ARCS", 10)
    damping, turn = 1e-6, 1.2345678
    A = (1 - damping) * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    with pytest.raises(NotConvergedError, match=r"^the norm of a system of order 2 lies between .* and .*: no nearer"):
        hinf_norm(ct.ss(A, [[1.0], [0.0]], [[1.0, 0.0]], [[0.0]], 1.0))
