"""Coupled axes: what the programme claims of its observer, measured again from its matrices."""

import control as ct
import numpy as np
import pytest

from dob_companion.lti.gramian import gramian
from dob_companion.lti.response import response
from dob_companion.synthesis import zpk
from dob_companion.synthesis.certify.certificate import Claim, certify
from dob_companion.synthesis.optimal.coupled import Block, Programme, Row
from dob_companion.synthesis.optimal.coupled_weights import coupled_weights
from dob_companion.synthesis.optimal.poles import free
from dob_companion.synthesis.optimal.problem import Spectrum, Wanted
from dob_companion.synthesis.plant.minimal import minimal
from dob_companion.synthesis.plant.models import stack
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.solve.optimum import find_optimum
from dob_companion.synthesis.spec.spectrum import LowPass
from tests.synthesis.paper import DT, PID, PLANT

NOISE, HEARD, MARGIN = 3.98e-4, 5e-4, 0.4
MIXER = np.array([[1.0, 0.15, -0.1], [0.1, 1.0, 0.2], [-0.05, 0.1, 1.0]])
GAINS = (0.6, 1.0, 0.35)
READ_HZ = 60.0


def system(mixer=MIXER):
    """The paper's dynamics in three axes behind a mixer."""
    G = stack([gain * PLANT for gain in GAINS])
    return minimal(ct.ss(G.A, G.B @ mixer, G.C, G.D @ mixer, DT)), minimal(stack([PID / gain for gain in GAINS]))


def solved(plant, controller, **limits):
    wanted = Wanted(disk_margin=MARGIN, noise=HEARD, noise_rms=NOISE, **limits)
    programme = Programme(Block(plant, controller, (1,) * 3, 6.5), Spectrum(LowPass(1.0)), wanted)
    x = free(np.exp(-np.geomspace(0.1, 0.75, 4)).astype(complex), programme.radius)
    return programme, programme.solve((Row.of(plant, x, programme.radius),) * 3)


@pytest.fixture(scope="module")
def coupled():
    plant, controller = system()
    return plant, controller, *solved(plant, controller, gains=())


def test_every_limit_holds_when_the_loop_is_wired_anew(coupled):
    plant, controller, _, best = coupled
    observer, one = best.observer(plant), ct.ss([], [], [], np.eye(3), DT)
    proof = certify(Problem(plant, controller, one, one, (1, 1, 1)), observer, Claim(1e3, "none", 1e3))
    assert proof.disk_margin >= MARGIN * (1.0 - 1e-3)
    assert proof.delay_margin_samples >= 2
    assert proof.command_leak < 1e-9
    heard = observer.C @ gramian(observer.A, observer.B[:, :3]) @ observer.C.T + observer.D[:, :3] @ observer.D[:, :3].T
    assert np.sqrt(np.max(np.diag(heard))) * NOISE <= HEARD * (1.0 + 1e-6)


def test_what_readings_of_the_moments_miss_comes_back_as_a_tenth_of_them_at_most(coupled):
    plant, controller, *_ = coupled
    worst = []
    for hz in (None, READ_HZ):
        _, best = solved(plant, controller, gains=(), moment_hz=hz)
        angles = np.linspace(1e-3, np.pi, 1000)
        D, G, C = (response(each, angles) for each in (best.observer(plant), plant, controller))
        late, one = np.exp(-1j * angles)[:, None, None], np.eye(3)
        left = one + late * D[:, :, 3:] + (C + late * D[:, :, :3]) @ G
        back = np.linalg.norm(np.linalg.solve(left, late * D[:, :, 3:]), 2, axis=(1, 2))
        worst.append(np.max(back * (1.0 - np.sinc(angles / (2.0 * np.pi * DT * READ_HZ)) ** 2)))
    assert worst[0] > 0.15
    assert worst[1] <= 0.1 * 1.01


def test_its_order_is_that_of_the_poles_and_its_matrices_are_what_was_solved_for(coupled):
    plant, _, programme, best = coupled
    observer = best.observer(plant)
    assert observer.nstates == 12
    assert np.allclose(response(observer, programme.angles)[:, :, :3], best.X, atol=1e-12)


def test_its_weights_are_found_in_closed_form_and_their_optimum_is_one(coupled):
    plant, controller, programme, best = coupled
    observer = best.observer(plant)
    W_d, W_n = coupled_weights(observer, 3, 1)
    assert W_d.nstates == observer.nstates + 3
    seen = response(observer, programme.angles)
    X, left = seen[:, :, :3], np.eye(3) + programme.late * seen[:, :, 3:]
    E, c = left @ response(W_d, programme.angles), W_n.D[0, 0]
    assert np.allclose(E @ E.conj().swapaxes(1, 2) + c**2 * X @ X.conj().swapaxes(1, 2), np.eye(3), atol=1e-10)
    problem = Problem(plant, controller, W_d, W_n, (1, 1, 1))
    star = find_optimum(problem).gamma_star
    assert star == pytest.approx(1.0, abs=1e-5)
    assert certify(problem, observer, Claim(star, "both", 1.0002)).gamma == pytest.approx(1.0, abs=1e-6)


def test_axes_as_coupled_as_these_lose_nothing_to_the_same_axes_apart(coupled):
    """Every observer of the axes apart has its like behind a known mixer; only noise and margins see the mixer."""
    *_, programme, best = coupled
    apart, alone = solved(*system(np.eye(3)), gains=())
    assert programme.attenuation(best.X, 1.0) > 0.9 * apart.attenuation(alone.X, 1.0) > 9.0


def test_gain_errors_in_the_objective_help_at_low_gain(coupled):
    plant, controller, programme, best = coupled
    _, sturdy = solved(plant, controller, gains=(0.7, 1.3))
    assert sturdy is not None
    assert programme.attenuation(sturdy.X, 0.7) > programme.attenuation(best.X, 0.7)


def test_a_pole_of_the_plant_on_the_unit_circle_is_no_obstacle_but_a_direct_term_is():
    integrating = minimal(zpk([], [1.0], 0.1, DT))
    assert len(Row.of(integrating, free(np.array([0.5, 0.6], complex), 0.99), 0.99).basis) == 2
    with pytest.raises(Exception, match="answers at once"):
        Block(ct.ss(integrating.A, integrating.B, integrating.C, [[1.0]], DT), PID, (1,), 6.5)
