import control as ct
import numpy as np
import pytest
from scipy import linalg

from dob_companion.synthesis.norms import gains, hinf_norm, response
from dob_companion.synthesis.reduce import gramian, hidden_modes, minimal

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
