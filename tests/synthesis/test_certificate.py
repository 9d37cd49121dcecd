import control as ct
import numpy as np
import pytest

from dob_companion.errors import NotCertifiedError
from dob_companion.lti.response import response, spectral_radius
from dob_companion.synthesis import synthesize
from dob_companion.synthesis.certify.certificate import Claim, certify
from dob_companion.synthesis.certify.margins import delay_margin, disk_margin
from dob_companion.synthesis.plant.loop import close_loop
from tests.synthesis import paper
from tests.synthesis.problems import random_problem, static

slycot = pytest.importorskip("slycot")


@pytest.fixture(scope="module")
def pitch():
    return synthesize(paper.PLANT, paper.PID, paper.W_D, paper.W_N)


def claim(proof, **changes):
    values = {"gamma_star": proof.gamma_star, "method": "test", "backoff": proof.gamma_backoff}
    return Claim(**(values | changes))


def changed(observer, **matrices):
    parts = {k: np.array(getattr(observer, k)) for k in "ABCD"} | matrices
    return ct.ss(parts["A"], parts["B"], parts["C"], parts["D"], observer.dt)


def test_a_level_beyond_the_backoff_is_refused_with_the_numbers(pitch):
    with pytest.raises(NotCertifiedError, match=r"measured gamma 1\.61.*at most 1\.6014"):
        certify(pitch.problem, pitch.observer, claim(pitch.certificate, backoff=1.001))


def test_an_observer_of_the_wrong_sign_is_refused(pitch):
    observer = changed(pitch.observer, C=-pitch.observer.C, D=-pitch.observer.D)
    with pytest.raises(NotCertifiedError):
        certify(pitch.problem, observer, claim(pitch.certificate))


def test_an_unstable_observer_is_refused(pitch):
    with pytest.raises(NotCertifiedError, match="observer is unstable"):
        certify(pitch.problem, changed(pitch.observer, A=1.5 * pitch.observer.A), claim(pitch.certificate))


def test_a_direct_path_from_the_applied_moment_is_refused(pitch):
    D = pitch.observer.D.copy()
    D[0, 1] = 1e-300
    with pytest.raises(NotCertifiedError, match="direct path from u_e"):
        certify(pitch.problem, changed(pitch.observer, D=D), claim(pitch.certificate))


def test_a_slip_of_one_per_cent_in_one_number_is_noticed(pitch):
    B = pitch.observer.B.copy()
    B[0, 1] *= 1.01
    with pytest.raises(NotCertifiedError, match=r"command leak 0\.01\d*, expected at most 1e-06"):
        certify(pitch.problem, changed(pitch.observer, B=B), claim(pitch.certificate, backoff=1.5))
    assert pitch.certificate.command_leak < 1e-9


def test_gamma_is_the_norm_slicot_finds_of_the_same_loop(pitch):
    loop = close_loop(paper.PLANT, paper.PID, pitch.observer, (1,))
    weighted = loop.part("error", "d", "n") * ct.append(paper.W_D, paper.W_N)
    n, (p, m) = weighted.nstates, weighted.D.shape
    s = weighted
    expected = slycot.ab13dd("D", "I", "N", "D", n, m, p, s.A, np.eye(n), s.B, s.C, s.D, tol=1e-10)[0]
    assert pitch.certificate.gamma == pytest.approx(expected, rel=1e-6)


def loop_gain(problem, observer):
    """L = (1 + z^-tau D_u)^-1 (C + z^-tau D_y) G: the loop broken between the observer's tap and the plant."""
    late = ct.ss([[0.0]], [[1.0]], [[1.0]], [[0.0]], problem.dt)
    D_y, D_u = late * observer[0, 0], late * observer[0, 1]
    one = static(1.0)
    return one.feedback(D_u) * (problem.controller + D_y) * problem.plant


def test_disk_margin_is_python_controls(pitch):
    omega = np.geomspace(1.0, np.pi / paper.DT, 4000)
    expected = ct.disk_margins(loop_gain(pitch.problem, pitch.observer), omega)[0]
    assert pitch.certificate.disk_margin == pytest.approx(expected, rel=1e-4)
    assert pitch.certificate.disk_margin <= expected * (1 + 1e-9)
    off = ct.disk_margins(paper.PID * paper.PLANT, omega)[0]
    assert pitch.certificate.extra["disk_margin_off"] == pytest.approx(off, rel=1e-4)


def test_multi_loop_disk_margin_is_python_controls():
    result = synthesize(*random_problem(1, 2, 2))
    loop = close_loop(result.problem.plant, result.problem.controller, result.observer, (1, 1))
    angles = np.linspace(1e-3, np.pi, 3000)
    M = response(loop.part("u_e", "d"), angles) + 0.5 * np.eye(2)
    mu = [slycot.ab13md(m, np.array([1, 1]), np.array([2, 2]))[0] for m in M]
    assert disk_margin(loop) == pytest.approx(1.0 / np.max(mu), rel=0.01)
    assert min(result.certificate.extra["disk_margin_per_axis"]) >= disk_margin(loop) * (1 - 1e-6)


def test_one_more_sample_than_the_delay_margin_destabilizes(pitch):
    k = pitch.certificate.delay_margin_samples
    assert k == delay_margin(pitch.problem, pitch.observer) >= 1

    def radius(extra):
        return spectral_radius(close_loop(paper.PLANT, paper.PID, pitch.observer, (1,), (extra,)).system.A)

    assert all(radius(extra) < 1.0 for extra in range(k + 1))
    assert radius(k + 1) >= 1.0


def test_delay_that_is_reported_truly_never_destabilizes(pitch):
    """u_e is measured where it acts: then d_hat depends on d and n alone, whatever the delay."""
    for delay in (0, 5, 40):
        assert spectral_radius(close_loop(paper.PLANT, paper.PID, pitch.observer, (delay,)).system.A) < 1.0


def test_bandwidth_is_the_first_crossing(pitch):
    angle = 2 * np.pi * pitch.certificate.estimation_bandwidth_hz * paper.DT
    T = close_loop(paper.PLANT, paper.PID, pitch.observer, (1,)).part("d_hat", "d")
    assert abs(1 - response(T, np.array([angle]))[0, 0, 0]) == pytest.approx(0.707, abs=1e-4)
    below = np.linspace(1e-4, 0.999 * angle, 500)
    assert np.max(np.abs(1 - response(T, below))) < 0.707
