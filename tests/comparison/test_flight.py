"""The loop and the weather: against the certificate, python-control, and independently computed reference values."""

import control as ct
import numpy as np
import pytest
from scipy import linalg

from dob_companion.comparison.flight import NOISE_SIGMA, attitude, expect, make_weather, rms
from dob_companion.comparison.kalman import kalman
from dob_companion.comparison.measure import LoopResponses, delay_margin
from dob_companion.comparison.vehicle import OUTPUTS, Vehicle, close, no_observer
from dob_companion.errors import NotConvergedError
from dob_companion.lti.gramian import gramian
from dob_companion.lti.response import response
from dob_companion.synthesis import block_responses, zpk
from tests.synthesis.paper import DT, PID, PLANT


def observer_of(design):
    data = design.blocks[0].observer
    return ct.ss(data.A, data.B, data.C, data.D, DT)


@pytest.fixture(scope="module")
def weather():
    """20 seeds, as `compare` makes them."""
    return make_weather(Vehicle(PLANT, PID, 1), 0.12, 20)


@pytest.mark.parametrize("tau", [0, 1])
def test_margins_and_noise_are_the_certificates(designs, tau):
    vehicle, proof = Vehicle(PLANT, PID, tau), designs[tau].blocks[0].certificate
    observer, responses = observer_of(designs[tau]), LoopResponses(vehicle)
    assert responses.disk_margin(observer) == pytest.approx(proof.disk_margin, rel=1e-3)
    assert responses.noise_peak(observer) == pytest.approx(proof.extra["noise_to_estimate_peak"], rel=1e-3)
    assert delay_margin(vehicle, observer) == proof.delay_margin_samples


@pytest.mark.parametrize("tau", [0, 1])
def test_the_loop_closed_in_time_and_in_frequency_is_the_designs(designs, tau):
    vehicle, observer = Vehicle(PLANT, PID, tau), observer_of(designs[tau])
    responses = LoopResponses(vehicle, 100)
    wanted = block_responses(designs[tau].blocks[0], DT, responses.hertz).error[:, 0, 0]
    loop = close(vehicle, observer, attitude=False)
    assert responses.error(observer) == pytest.approx(wanted, abs=1e-9)
    assert response(loop, responses.angles)[:, OUTPUTS.index("error"), 0] == pytest.approx(wanted, abs=1e-9)


def test_delay_that_the_vehicle_reports_and_delay_that_it_does_not_are_different_things(vehicle):
    told = kalman(PLANT, 1, 1.0, 0.05, NOISE_SIGMA)
    assert expect(close(vehicle.with_delay(8), told), 0.05) is not None
    assert expect(close(vehicle, told, unseen=8), 0.05) is None


def test_flights_are_those_of_python_control(designs, vehicle, weather):
    loop = close(vehicle, observer_of(designs[1]))
    one = ct.forced_response(loop, U=np.vstack([weather.d[:500, 0], weather.n[:500, 0]])).outputs
    theta = one[OUTPUTS.index("theta")]
    assert attitude(loop, weather.d[:500], weather.n[:500])[:, 0] == pytest.approx(theta - theta.mean(), abs=1e-12)


def test_attitude_is_the_mean_rate_of_each_sample_added_up(designs, vehicle, weather):
    loop = close(vehicle, observer_of(designs[1]))
    y, theta = ct.forced_response(loop, U=np.vstack([weather.d[:300, 0], weather.n[:300, 0]])).outputs[[0, 4]]
    assert np.diff(theta) == pytest.approx(DT * (y[1:] + y[:-1]) / 2.0, abs=1e-15)


def test_every_seed_peaks_at_the_papers_value_with_the_observer_off(vehicle, weather):
    theta = attitude(close(vehicle, no_observer(DT)), weather.d, weather.n)
    assert np.max(np.abs(theta), axis=0) == pytest.approx(0.12, rel=1e-6)


def test_a_peak_that_the_noise_alone_goes_beyond_has_no_weather(vehicle):
    with pytest.raises(NotConvergedError, match=r"peak at 1e-06 rad .* noise alone .* at up to 2\.57e-05 rad"):
        make_weather(vehicle, 1e-6, 2)


def test_the_weather_of_a_seed_is_always_the_same(vehicle, weather):
    again = make_weather(vehicle, 0.12, 2)
    assert np.array_equal(again.n, weather.n[:, :2])
    assert again.d == pytest.approx(weather.d[:, :2], rel=1e-12)


@pytest.mark.parametrize("with_observer", [False, True])
def test_what_is_expected_is_what_flights_come_to(designs, vehicle, with_observer):
    """Lyapunov against 40 flights of one scale: sampling leaves about 2 % of the RMS."""
    observer = observer_of(designs[1]) if with_observer else no_observer(DT)
    weather, loop = make_weather(vehicle, 0.12, 40), close(vehicle, observer)
    theta = attitude(loop, weather.d / weather.scale * weather.typical_scale, weather.n)
    assert np.sqrt(np.mean(rms(theta) ** 2)) == pytest.approx(expect(loop, weather.typical_scale).attitude, rel=0.03)


def test_noise_in_the_correction_is_what_noise_alone_makes_of_it(designs, vehicle, weather):
    loop = close(vehicle, observer_of(designs[1]))
    d_hat = ct.forced_response(loop, U=np.vstack([np.zeros(15000), weather.n[:, 0]])).outputs[OUTPUTS.index("d_hat")]
    assert np.std(d_hat) == pytest.approx(expect(loop, 0.05).noise_in_correction, rel=0.03)


def test_covariances_are_scipys(designs, vehicle):
    loop = close(vehicle, observer_of(designs[1]))
    wanted = linalg.solve_discrete_lyapunov(loop.A, loop.B @ loop.B.T, method="direct")
    assert gramian(loop.A, loop.B) == pytest.approx(wanted, rel=1e-8, abs=1e-12 * np.max(np.abs(wanted)))


@pytest.mark.parametrize(
    ("tau", "attenuation", "peak"), [(0, 10.7, 0.0128), (1, 8.5, 0.0162), (2, 7.0, 0.0196), (3, 6.0, 0.0228)]
)
def test_the_papers_design_flown_later_than_designed_is_the_reference(designs, weather, tau, attenuation, peak):
    """The tau = 0 observer told the applied moment, its correction tau samples late."""
    vehicle, scale = Vehicle(PLANT, PID, tau), weather.typical_scale
    off, on = (close(vehicle, o) for o in (no_observer(DT), observer_of(designs[0])))
    assert expect(off, scale).attitude / expect(on, scale).attitude == pytest.approx(attenuation, rel=0.01)
    assert np.mean(np.max(np.abs(attitude(on, weather.d, weather.n)), axis=0)) == pytest.approx(peak, rel=0.04)


@pytest.mark.parametrize(("tau", "better"), [(0, 1.89), (1, 1.41), (2, 1.22), (3, 1.12)])
def test_a_kalman_filter_told_the_truth_is_as_much_better_as_the_reference(designs, weather, tau, better):
    vehicle, scale = Vehicle(PLANT, PID, tau), weather.typical_scale
    told = kalman(PLANT, tau, 1.0, scale, NOISE_SIGMA)
    ours, theirs = (expect(close(vehicle, o), scale).attitude for o in (observer_of(designs[0]), told))
    assert ours / theirs == pytest.approx(better, rel=0.01)


def test_a_plant_that_answers_at_once_is_refused():
    with pytest.raises(ValueError, match="strictly proper"):
        close(Vehicle(zpk([0.5], [0.9], 1.0, DT), PID, 1), no_observer(DT))
