"""The responses that the programmes share, against the closed loop of the comparison."""

import control as ct
import numpy as np
import pytest

from dob_companion.comparison.flight import expect
from dob_companion.comparison.vehicle import OUTPUTS, close, no_observer
from dob_companion.errors import UnsolvableError
from dob_companion.lti.response import response
from dob_companion.synthesis import design_from_toml
from dob_companion.synthesis.optimal.problem import Axis, Spectrum, attenuation, grid, responses
from dob_companion.synthesis.plant.models import from_data
from dob_companion.synthesis.spec.spectrum import Band, Dryden, LowPass, Measured
from tests.synthesis.optimal.axes import EXAMPLES, NOISE, SPECS, axis_of, vehicle_of, weather_of


@pytest.fixture(scope="module")
def shipped():
    """The shipped observers of one sample of delay."""
    design = design_from_toml((EXAMPLES / SPECS[1]).read_text(encoding="utf-8"))
    return {block.name: from_data(block.observer, design.dt) for block in design.blocks}


LEAK = 1e-4
"""A certified observer lets some 1e-7 of the command through, so that it is no F exactly."""


def filter_of(observer, on):
    """F of d_hat = F (M y_n - N u_e), from D(z)."""
    return response(observer, on.angles)[:, 0, 0] / on.M


@pytest.mark.parametrize("name", ["pitch", "roll", "yaw"])
def test_responses_are_those_of_the_closed_loop_at_every_gain_of_the_plant(shipped, name):
    vehicle, on = vehicle_of(name), responses(axis_of(name), grid(200, 1e-3))
    F = filter_of(shipped[name], on)
    inner = response(close(vehicle, shipped[name], attitude=False), on.angles)
    u, d_hat, error = (OUTPUTS.index(key) for key in ("u_e", "d_hat", "error"))
    assert np.allclose(1.0 + inner[:, u, 0], on.sensitivity(F), rtol=1e-4, atol=LEAK)
    assert np.allclose(inner[:, error, 0], 1.0 - on.T(F), rtol=1e-4, atol=LEAK)
    assert np.allclose(inner[:, d_hat, 1], F * on.M, rtol=1e-4)
    for gain in (0.7, 1.0, 1.3):
        theta = response(close(vehicle.with_gain(gain), shipped[name]), on.angles)[:, OUTPUTS.index("theta")]
        from_d, from_n = on.attitude(F, gain)
        without, _ = on.attitude(0.0 * F, gain)
        assert np.all(np.abs(theta[:, 0] - from_d) <= 1e-4 * np.abs(from_d) + LEAK * np.abs(without) + 1e-15)
        assert np.allclose(theta[:, 1], from_n, rtol=1e-4)


@pytest.mark.parametrize("gain", [0.7, 1.0, 1.3])
def test_the_attenuation_is_that_of_the_lyapunov_equations(shipped, gain):
    vehicle, on, weather = vehicle_of("roll"), responses(axis_of("roll"), grid()), weather_of("roll")
    off, with_it = (
        expect(close(vehicle.with_gain(gain), observer), weather.rms).attitude
        for observer in (no_observer(vehicle.dt), shipped["roll"])
    )
    found = attenuation(on, weather, NOISE, filter_of(shipped["roll"], on), gain)
    assert found == pytest.approx(off / with_it, rel=1e-3)


def test_without_an_rms_the_disturbances_size_and_the_gyro_noise_play_no_part(shipped):
    on, weather = responses(axis_of("pitch"), grid()), weather_of("pitch")
    F = filter_of(shipped["pitch"], on)
    silent = attenuation(on, Spectrum(weather.shape), NOISE, F)
    assert silent == pytest.approx(attenuation(on, Spectrum(weather.shape, 1e6), NOISE, F), rel=1e-6)
    assert silent > attenuation(on, weather, NOISE, F)


def test_a_low_pass_is_white_noise_through_its_pole():
    hz, dt = 3.0, 0.004
    angles = grid()
    a = np.exp(-2.0 * np.pi * hz * dt)
    shape = np.abs(response(ct.ss([[a]], [[1.0]], [[np.sqrt(1.0 - a * a)]], [[0.0]], dt), angles)[:, 0, 0])
    on = Spectrum(LowPass(hz), 0.3).amplitude(angles, dt)
    assert np.sqrt(np.sum(on**2)) == pytest.approx(0.3)
    assert np.allclose(on / on[0], shape / shape[0] * np.sqrt(np.gradient(angles) / np.gradient(angles)[0]))


def test_every_spectrum_is_smooth_and_falls_beyond_its_corner():
    dt = 0.004
    angles = 2.0 * np.pi * dt * np.array([1.0, 60.0, 120.0])
    for shape in (LowPass(1.0), Band(0.1, 3.0), Dryden(8.0, 20.0), Measured((0.1, 1.0, 10.0), (1.0, 1.0, 0.01))):
        power = shape.density(angles, dt)
        assert power[0] > power[1] > power[2] > 0.0, shape.words
    assert Measured((0.1, 1.0, 10.0), (4.0, 2.0, 1.0)).density(angles[:1], dt) == pytest.approx(2.0)


def test_a_plant_that_answers_at_once_is_refused():
    with pytest.raises(UnsolvableError, match="answers at once"):
        Axis.of(ct.ss([[0.5]], [[1.0]], [[1.0]], [[0.1]], 0.01), ct.ss([], [], [], [[0.1]], 0.01), 1, 6.5)
