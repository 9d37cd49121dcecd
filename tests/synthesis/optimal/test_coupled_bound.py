"""The bound on every observer of coupled axes: what is known of axes apart, and no observer above it."""

from dataclasses import replace

import control as ct
import numpy as np
import pytest
from scipy import linalg

from dob_companion.lti.response import response
from dob_companion.synthesis import zpk
from dob_companion.synthesis.norms.structured import structured_bounds
from dob_companion.synthesis.optimal import bound
from dob_companion.synthesis.optimal.bound import KNOTS, AttenuationLimits, Dual, Ground, attenuation_limit
from dob_companion.synthesis.optimal.coupled import Row, Solved
from dob_companion.synthesis.optimal.poles import free
from dob_companion.synthesis.optimal.problem import Axis, Block, Spectrum, Wanted, attitude_rms, grid, responses
from dob_companion.synthesis.plant.minimal import minimal
from dob_companion.synthesis.spec.spectrum import LowPass
from tests.synthesis.optimal.test_coupled import GAINS, HEARD, MARGIN, MIXER, NOISE, solved, system
from tests.synthesis.paper import DT, PID, PLANT

WEATHER, K = Spectrum(LowPass(1.0), 0.05), 6.5
WANTED = Wanted(disk_margin=MARGIN, noise=HEARD, noise_rms=NOISE, gains=())


def mixed(mixer=MIXER, count=3):
    plant, controller = system(mixer)
    return Block(minimal(plant[:count, :count]), minimal(controller[:count, :count]), (1,) * count, K)


def single(gain):
    return Block(minimal(gain * PLANT), minimal(PID / gain), (1,), K)


@pytest.mark.parametrize("peak", [None, 0.8])
def test_axes_apart_have_the_sum_of_what_each_has_alone_whatever_the_multipliers(peak):
    wanted, rng, count = replace(WANTED, peak=peak), np.random.default_rng(0), 2**11
    singles = [Ground(single(gain), WEATHER, NOISE, count) for gain in GAINS]
    whole = Dual(Ground(mixed(np.eye(3)), WEATHER, NOISE, count), wanted)
    noise, at_knots = rng.random(3), rng.random((1 if peak is None else 2, 3, KNOTS))
    shares = off_power()
    found = whole.bound(1e-4 * np.concatenate([noise * shares, (at_knots * shares[:, None]).ravel()]))
    alone = [
        Dual(ground, wanted).bound(1e-4 * np.concatenate([noise[i : i + 1], at_knots[:, i].ravel()]))
        for i, ground in enumerate(singles)
    ]
    assert found == pytest.approx(shares @ alone, rel=1e-6)


def off_power(count=3):
    """Each axis' share of the squared attitude error with the observer off."""
    angles = grid(4000)
    nothing = np.zeros(len(angles))
    axes = [Axis.of(block.plant, block.controller, 1, K) for block in map(single, GAINS[:count])]
    power = [attitude_rms(responses(axis, angles), WEATHER, NOISE, nothing) ** 2 for axis in axes]
    return np.array(power) / np.sum(power)


def random_observer(block, rng):
    """Stable and command invariant, of order four for each moment."""
    rows = tuple(Row.of(block.plant, free(rng.uniform(0.3, 0.9, 4).astype(complex), 0.99), 0.99) for _ in block.delays)
    y = rng.standard_normal(sum(len(row.basis) for row in rows)) * 0.02
    return Solved(rows, y, np.zeros(0), 0.0).observer(block.plant)


@pytest.mark.parametrize("seed", range(4))
def test_no_observer_has_less_of_the_lagrangian_than_the_bound(seed):
    """Attitude error and excess of every limit from the wired loop's formulas, no coprime factors in them."""
    rng, block, wanted = np.random.default_rng(seed), mixed(), replace(WANTED, peak=0.8)
    ground = Ground(block, WEATHER, NOISE, 2**11)
    dual = Dual(ground, wanted)
    at = 1e-4 * rng.random(dual.size)
    least, angles, density = dual.bound(at), ground.circle.angles, ground.circle.density[:, None]
    z, one = np.exp(1j * angles)[:, None, None], np.eye(3)
    G, C = response(block.plant, angles), response(block.controller, angles)
    S, integral = np.linalg.inv(one + C @ G), DT / 2.0 * (z + 1.0) / (z - 1.0)
    held = integral * G @ np.linalg.inv(one + C @ G * (1.0 + K * integral))
    wind, hiss = WEATHER.amplitude(angles, DT), WEATHER.hiss(angles, NOISE)

    def lagrangian(X):
        T = X @ G / z
        parts = ((wind, held @ (one - T)), (hiss, held @ (C + X / z)))
        error = sum(np.sum(size**2 * np.sum(np.abs(each) ** 2, axis=(1, 2))) for size, each in parts)
        rows = np.sum(np.abs(X) ** 2, axis=2)
        loud = np.mean(density * rows, axis=0) * (NOISE / HEARD) ** 2 - 1.0
        far = (MARGIN * np.abs(np.einsum("nii->ni", S @ (one - T)) - 0.5)) ** 2 - 1.0
        excess = [loud, *(ground.hats.gathered(density * each) for each in (far, rows / wanted.peak**2 - 1.0))]
        return error, at @ np.concatenate([each.ravel() for each in excess])

    off = lagrangian(np.zeros_like(C))[0]
    for _ in range(10):
        error, excess = lagrangian(response(random_observer(block, rng), angles)[:, :, :3])
        assert error / off + excess >= least


def test_its_slope_is_that_of_its_values_and_it_is_the_same_for_any_coprime_factors(monkeypatch):
    wanted, block = replace(WANTED, peak=0.8), mixed(count=2)
    rng = np.random.default_rng(3)
    dual = Dual(Ground(block, WEATHER, NOISE, 2**10), wanted)
    at = 1e-4 * rng.random(dual.size)
    to = at * rng.standard_normal(dual.size)
    up, down = (dual.value(at + sign * 1e-4 * to)[0] for sign in (1.0, -1.0))
    assert dual.value(at)[1] @ to == pytest.approx((up - down) / 2e-4, rel=1e-4)
    monkeypatch.setattr(bound, "left_coprime", faster)
    other = Dual(Ground(block, WEATHER, NOISE, 2**10), wanted)
    assert other.value(at)[0] == pytest.approx(dual.value(at)[0], rel=1e-7)


def faster(plant):
    """With every pole of the factors at 0.2 … 0.4."""
    L = ct.place(plant.A.T, plant.C.T, np.linspace(0.2, 0.4, plant.nstates)).T
    A, one = plant.A - L @ plant.C, np.eye(len(plant.C))
    return ct.ss(A, -L, plant.C, one, DT), ct.ss(A, plant.B, plant.C, 0.0 * one, DT)


def test_attitudes_in_other_coordinates_change_nothing():
    block = mixed(count=2)
    turn = linalg.expm(np.array([[0.0, 0.7], [-0.7, 0.0]]))
    G, C = block.plant, block.controller
    turned = Block(
        ct.ss(G.A, G.B, turn @ G.C, G.D, DT), ct.ss(C.A, C.B @ turn.T, C.C, C.D @ turn.T, DT), block.delays, K
    )
    dual, other = (Dual(Ground(each, WEATHER, NOISE, 2**10), WANTED) for each in (block, turned))
    at = 1e-4 * np.random.default_rng(4).random(dual.size)
    assert other.value(at)[0] == pytest.approx(dual.value(at)[0], rel=1e-7)


def test_a_finer_grid_says_the_same_of_an_axis_that_integrates_beside_one_with_drag_and_a_longer_delay():
    """Factors then vanish at z = 1 in some directions only."""
    plant = ct.append(0.6 * PLANT, zpk([-1.716], [0.995, 0.9447], 0.14131, DT))
    mixed_plant = minimal(ct.ss(plant.A, plant.B @ MIXER[:2, :2], plant.C, plant.D, DT))
    block = Block(mixed_plant, minimal(ct.append(PID / 0.6, PID)), (1, 3), K)
    at = 1e-4 * np.random.default_rng(6).random(2 * (1 + KNOTS))
    coarse, fine = (Dual(Ground(block, WEATHER, NOISE, count), WANTED).bound(at) for count in (2**11, 2**13))
    assert fine * (1.0 - 1e-3) < coarse < fine * (1.0 + 1e-5)


def test_axes_apart_have_the_bound_that_each_has_alone():
    apart = attenuation_limit(mixed(np.eye(3), 2), WEATHER, WANTED)
    alone = np.array([attenuation_limit(single(gain), WEATHER, WANTED) for gain in GAINS[:2]])
    assert apart == pytest.approx(float(off_power(2) @ alone**-2.0) ** -0.5, rel=1e-3)


@pytest.fixture
def coarse(monkeypatch):
    """Grids that take a third of the time and give the bound to three digits."""
    monkeypatch.setattr(bound, "SEARCHED", 2**9)
    monkeypatch.setattr(bound, "EVALUATED", 2**12)


@pytest.mark.usefixtures("coarse")
def test_what_a_programme_reaches_for_coupled_axes_is_below_it():
    programme, best = solved(*system(), gains=())
    limit = attenuation_limit(mixed(), Spectrum(LowPass(1.0)), WANTED)
    assert 0.6 * limit < programme.attenuation(best.X, 1.0) < limit


@pytest.mark.usefixtures("coarse")
def test_stricter_limits_leave_less_to_coupled_axes():
    limits = AttenuationLimits(mixed(count=2), WEATHER, NOISE)
    found = [limits.of(each) for each in (WANTED, replace(WANTED, disk_margin=0.5), replace(WANTED, noise=0.5 * HEARD))]
    assert max(found[1:]) < found[0]


def test_no_entry_off_the_diagonal_is_bounded_by_a_disk_margin_of_all_loops_at_once():
    """Why the bound asks for no more than the margin of each loop: what is allowed at an angle has no smaller hull."""
    M = np.triu(np.random.default_rng(5).standard_normal((1, 3, 3)), 1) * 1e6 + np.diag([0.9, 1.0j, -1.0])
    assert structured_bounds(M)[0][0] == pytest.approx(1.0, rel=1e-3)
