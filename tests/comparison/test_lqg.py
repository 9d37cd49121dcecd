"""The LQG bound by its two routes, the best at a price, and where designs stand below them."""

from pathlib import Path

import control as ct
import numpy as np
import pytest

from dob_companion.comparison.at_price import AtPrice
from dob_companion.comparison.evaluate import expected_attenuation
from dob_companion.comparison.flight import NOISE_SIGMA, expect, make_weather
from dob_companion.comparison.kalman import kalman
from dob_companion.comparison.lqg import lqg, lqg_attitude_bound
from dob_companion.comparison.measure import LoopResponses
from dob_companion.comparison.shortfall import NO_LINK, shortfall, shortfall_table
from dob_companion.comparison.vehicle import Vehicle, close, no_observer
from dob_companion.lti.response import response
from dob_companion.synthesis import design_from_toml, zpk
from tests.comparison.test_flight import observer_of
from tests.synthesis.paper import DT, PID, PLANT

SIGMA = 0.0537
EXAMPLES = Path(__file__).parents[2] / "examples"
LATE_ZERO = zpk([1.3, -0.4], [1.0, 0.9, 0.0], -0.05, DT)
"""Another plant: a slow zero outside the circle, a sample of pure delay."""


def vehicle_of(delay, plant=PLANT, controller=PID):
    return Vehicle(plant, controller, delay)


def system_of(data):
    return ct.ss(data.A, data.B, data.C, data.D, DT)


def attitude(vehicle, observer):
    return expect(close(vehicle, observer), SIGMA).attitude


@pytest.mark.parametrize("delay", [0, 1, 2, 3])
def test_two_riccati_equations_come_down_to_the_bound_as_the_control_weight_vanishes(delay):
    bound = lqg_attitude_bound(vehicle_of(delay), SIGMA)
    costs = [lqg(vehicle_of(delay), SIGMA, weight).attitude for weight in (1e-1, 1e-3, 1e-5, 1e-6)]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] >= bound
    assert costs[-1] == pytest.approx(bound, rel=0.01)


def test_both_routes_agree_on_another_plant_too():
    vehicle = vehicle_of(1, LATE_ZERO, zpk([], [], 0.02, DT))
    assert expect(close(vehicle, no_observer(DT)), SIGMA) is not None
    bound = lqg_attitude_bound(vehicle, SIGMA)
    assert lqg(vehicle, SIGMA, 1e-6).attitude == pytest.approx(bound, rel=0.02)


def test_the_cost_of_an_lqg_loop_is_what_long_flights_come_to():
    """Lyapunov against the loop stepped through 100 flights of 80 s, the first 40 s left out."""
    found = lqg(vehicle_of(1), SIGMA, 0.1)
    rng = np.random.default_rng(1)
    A, B, C, D = (np.asarray(m) for m in (found.loop.A, found.loop.B, found.loop.C, found.loop.D))
    x, squares = np.zeros((len(A), 100)), np.zeros(2)
    for k in range(20000):
        w = rng.standard_normal((2, 100))
        if k >= 10000:
            squares += np.mean((C @ x + D @ w) ** 2, axis=1)
        x = A @ x + B @ w
    assert np.sqrt(squares / 10000) == pytest.approx([found.attitude, found.correction], rel=0.03)


def test_a_dearer_correction_is_used_less():
    cheap, dear = (lqg(vehicle_of(1), SIGMA, weight) for weight in (0.01, 1.0))
    assert dear.correction < cheap.correction
    off = attitude(vehicle_of(1), no_observer(DT))
    assert cheap.attitude < dear.attitude < off
    assert lqg(vehicle_of(1), SIGMA, 1e4).attitude == pytest.approx(off, rel=1e-3)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_no_observer_undercuts_the_bound(delay, designs):
    vehicle, bound = vehicle_of(delay), lqg_attitude_bound(vehicle_of(delay), SIGMA)
    told = kalman(PLANT, delay, 1.0, SIGMA, NOISE_SIGMA)
    for observer in (observer_of(designs[0]), told, AtPrice(vehicle, SIGMA).best()):
        assert attitude(vehicle, observer) > bound


def test_without_a_price_the_best_is_nearly_the_bound():
    """Within the few per cent that the sixty free samples of F lack."""
    vehicle = vehicle_of(1)
    best = attitude(vehicle, AtPrice(vehicle, SIGMA).best())
    assert best == pytest.approx(lqg_attitude_bound(vehicle, SIGMA), rel=0.03)


@pytest.mark.parametrize("delay", [1, 2])
def test_the_best_at_a_price_pays_it_in_its_own_loop(delay):
    """Measured of the observer built from F, by Lyapunov equation and frequency response."""
    vehicle = vehicle_of(delay)
    best = AtPrice(vehicle, SIGMA).best(0.4, 3e-4)
    assert LoopResponses(vehicle).disk_margin(best) == pytest.approx(0.4, rel=2e-3)
    assert expect(close(vehicle, best), SIGMA).noise_in_correction == pytest.approx(3e-4, rel=1e-3)
    angles = np.geomspace(1e-3, 3.0, 40)
    D = response(best, angles)[:, 0, :]
    leak = D[:, 0] * response(PLANT, angles)[:, 0, 0] + D[:, 1]
    assert np.max(np.abs(leak)) < 1e-8


def test_a_richer_filter_and_a_neighbouring_price_change_what_is_best_as_they_should():
    vehicle = vehicle_of(1)
    best = {taps: attitude(vehicle, AtPrice(vehicle, SIGMA, taps).best(0.4, 3e-4)) for taps in (60, 100)}
    assert best[100] <= 1.0001 * best[60]
    assert best[100] == pytest.approx(best[60], rel=0.01)
    ready = AtPrice(vehicle, SIGMA)
    quieter, safer = (attitude(vehicle, ready.best(*price)) for price in ((0.4, 2e-4), (0.5, 3e-4)))
    assert min(quieter, safer) > best[60]


def test_a_price_that_nothing_pays_is_refused():
    with pytest.raises(ValueError, match=r"disk margin 1\.9"):
        AtPrice(vehicle_of(1), SIGMA).best(1.9)


def test_at_the_price_of_the_papers_weights_more_is_to_be_had(designs):
    found = shortfall(designs[1].blocks[0], DT, SIGMA)
    assert found.design.attenuation == pytest.approx(9.18, rel=0.01)
    assert found.at_price.attenuation == pytest.approx(14.89, rel=0.01)
    assert found.bound.attenuation == pytest.approx(734.5, rel=0.01)
    gains = {step.name: step.attenuation for step in found.steps}
    assert found.design.attenuation < gains["back-off 1.0001"] < found.at_price.attenuation < gains[NO_LINK]
    assert found.at_price.attenuation < gains["best with any disk margin"] < gains["best with any noise"]
    assert "RMS attitude error 62 % above the best at its price" in shortfall_table(found)


@pytest.mark.proof
@pytest.mark.parametrize(
    ("name", "delay", "least"),
    [("tuned", 1, 16.9), ("tuned_2", 2, 12.7), ("tuned_3", 3, 9.9)],
)
def test_the_tuned_examples_stand_as_near_to_the_best_at_their_price_as_documented(name, delay, least):
    design = design_from_toml((EXAMPLES / f"tailsitter_{name}.toml").read_text(encoding="utf-8"))
    assert design.delay_samples == delay
    for block in design.blocks:
        plant, controller, observer = map(system_of, (block.problem.plant, block.problem.controller, block.observer))
        vehicle, proof = Vehicle(plant, controller, delay), block.certificate
        scale = make_weather(vehicle, 0.12, 2).typical_scale
        flown = expect(close(vehicle, observer), scale)
        best = AtPrice(vehicle, scale).best(proof.disk_margin, flown.noise_in_correction)
        assert flown.attitude <= 1.07 * expect(close(vehicle, best), scale).attitude
        assert proof.delay_margin_samples >= 2
        assert proof.disk_margin > 0.355
        assert expected_attenuation(vehicle, observer, scale) >= least
        for factor in (0.7, 1.3):
            assert expected_attenuation(vehicle.with_gain(factor), observer, scale) >= 0.8 * least
