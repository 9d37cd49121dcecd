"""Axes, controllers, attitude and weather against independent computations."""

import math

import numpy as np
import pytest
from scipy.signal import freqz, lfilter
from scipy.spatial.transform import Rotation

from sitl.airframe.linear import PITCH, ROLL, YAW, LinearAxis
from sitl.airframe.surroundings import STILL, Surroundings
from sitl.attitude import attitude_error, down_component, multiply, rotated_by_rate
from sitl.autopilot.aircraft import LINEAR_TUNING, linear
from sitl.autopilot.controller import ATTITUDE_GAIN, RateController
from sitl.autopilot.correction import CorrectionInput
from sitl.autopilot.tuning import PITCH_PID
from sitl.autopilot.vehicle import Vehicle
from sitl.constants import DT
from sitl.weather.disturbance import CALM, SEGMENT, Weather, first_order_pole, noise_sigma

G = (PITCH.gain * np.array([0.0, 1.0, -PITCH.zero]), np.poly([1.0, PITCH.pole]))
C = (PITCH_PID.gain * np.poly(PITCH_PID.zeros), np.poly([0.0, 1.0]))
INTEGRATOR = (0.5 * DT * np.array([1.0, 1.0]), np.array([1.0, -1.0]))  # trapezoid, rate to angle


def hovering() -> Vehicle:
    vehicle = Vehicle(linear())
    vehicle.arm()
    vehicle.take_off(2.0)
    while vehicle.airframe.altitude < 1.9:
        vehicle.step(STILL, (0.0, 0.0, 0.0), CorrectionInput())
    return vehicle


def disturbance_to_angle() -> tuple[np.ndarray, np.ndarray]:
    """theta = T (G (d + u)), u = C (-K theta - G (d + u)): numerator and denominator by plain polynomial algebra."""
    (gn, gd), (cn, cd), (tn, td) = G, C, INTEGRATOR
    num = np.polymul(np.polymul(tn, gn), cd)
    loop = np.polymul(np.polymul(gn, cn), np.polyadd(td, ATTITUDE_GAIN * tn))
    den = np.polyadd(np.polymul(np.polymul(gd, cd), td), loop)
    return np.pad(num, (len(den) - len(num), 0)), den  # numpy drops the leading zeros that lfilter needs


@pytest.mark.parametrize("axis", [ROLL, PITCH, YAW])
def test_a_linear_axis_is_the_transfer_function_it_names(axis):
    u = np.random.default_rng(1).standard_normal(2000)
    model = LinearAxis(axis)
    y = [model.rate] + [model.advance(v) for v in u[:-1]]
    expected = lfilter(axis.gain * np.array([0.0, 1.0, -axis.zero]), np.poly([axis.slow, axis.pole]), u)
    np.testing.assert_allclose(y, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("gains", LINEAR_TUNING.rate)
def test_a_rate_controller_is_the_transfer_function_it_names_below_saturation(gains):
    e = 0.05 * np.random.default_rng(2).standard_normal(2000)
    expected = lfilter(gains.gain * np.poly(gains.zeros), np.poly([0.0, 1.0]), e)
    assert np.abs(expected).max() < 1.0
    controller = RateController(gains)
    np.testing.assert_allclose([controller.step(v) for v in e], expected, atol=1e-12)


def test_the_integrator_of_a_rate_controller_does_not_wind_up():
    controller = RateController(PITCH_PID)
    torque = [controller.step(5.0) for _ in range(100_000)]
    assert max(torque) == torque[-1] == 1.0
    assert controller.step(-5.0) < 0.0
    controller.step(0.0)
    assert 0.9 < controller.step(0.0) < 1.0


@pytest.mark.parametrize(("hertz", "decibel"), [(0.1, 15.5), (1.0, 16.5), (5.0, 16.1), (10.0, 14.1), (15.0, 10.7)])
def test_the_rate_loop_answers_a_disturbance_as_the_reference_table_says(hertz, decibel):
    _, g = freqz(*G, worN=[2 * math.pi * hertz * DT])
    _, c = freqz(*C, worN=[2 * math.pi * hertz * DT])
    assert 20 * math.log10(abs(g[0] / (1 + g[0] * c[0]))) == pytest.approx(decibel, abs=0.06)


@pytest.mark.parametrize(("axis", "hertz", "degrees"), [(0, 5.4, 58.6), (1, 14.2, 49.0), (2, 3.1, 73.0)])
def test_each_rate_loop_crosses_over_where_it_was_tuned_to(axis, hertz, degrees):
    model, pid = (ROLL, PITCH, YAW)[axis], LINEAR_TUNING.rate[axis]
    f = np.linspace(0.5, 40.0, 20_000)
    z = np.exp(2j * math.pi * f * DT)
    plant = model.gain * (z - model.zero) / ((z - model.slow) * (z - model.pole))
    loop = plant * pid.gain * (z - pid.zeros[0]) * (z - pid.zeros[1]) / (z * (z - 1.0))
    (last,) = np.flatnonzero(np.diff(np.sign(np.abs(loop) - 1.0)))
    assert f[last] == pytest.approx(hertz, abs=0.1)
    assert 180.0 + np.degrees(np.angle(loop[last])) == pytest.approx(degrees, abs=1.0)


def test_turning_at_a_constant_rate_is_exact_and_keeps_the_norm():
    rate, n = (0.9, -2.1, 1.4), 5000
    q = (1.0, 0.0, 0.0, 0.0)
    for _ in range(n):
        q = rotated_by_rate(q, rate, DT)
    assert math.hypot(*q) == pytest.approx(1.0, abs=1e-15)
    w, x, y, z = q
    expected = Rotation.from_rotvec(np.array(rate) * n * DT)
    assert (Rotation.from_quat([x, y, z, w]) * expected.inv()).magnitude() < 1e-10


def test_the_attitude_error_takes_the_shorter_way_and_ignores_the_sign_of_a_quaternion():
    command = rotated_by_rate((1.0, 0.0, 0.0, 0.0), (0.3, -0.2, 0.9), 1.0)
    q = rotated_by_rate(command, (0.0, 0.02, 0.0), 1.0)
    assert attitude_error(command, q) == pytest.approx((0.0, 0.02, 0.0), abs=1e-6)
    assert attitude_error(command, tuple(-v for v in q)) == pytest.approx(attitude_error(command, q))
    assert multiply(q, (1.0, 0.0, 0.0, 0.0)) == q
    assert down_component((math.cos(0.25), math.sin(0.25), 0.0, 0.0)) == pytest.approx(math.cos(0.5))


@pytest.mark.parametrize("turn", [(2.9, 0.0, 0.0), (0.0, -1.5, 0.0), (0.0, 0.0, 3.0)])
def test_the_attitude_loop_brings_the_vehicle_upright_from_any_side(turn):
    vehicle = hovering()
    vehicle.airframe.attitude = rotated_by_rate((1.0, 0.0, 0.0, 0.0), turn, 1.0)
    vehicle.airframe.altitude = 500.0  # room to fall while it is upside down
    for _ in range(round(12.0 / DT)):
        sample = vehicle.step(STILL, (0.0, 0.0, 0.0), CorrectionInput())
    assert max(map(abs, sample.attitude_error)) < 0.01


def test_a_disturbed_axis_moves_as_an_independent_linear_computation_says():
    vehicle = hovering()
    d = lfilter([0.01], [1.0, -first_order_pole(1.0)], np.random.default_rng(3).standard_normal(8000))
    angle = [vehicle.step(Surroundings((0.0, v, 0.0)), (0.0, 0.0, 0.0), CorrectionInput()).attitude_error[1] for v in d]
    expected = lfilter(*disturbance_to_angle(), d)
    assert np.abs(expected).max() > 0.01
    np.testing.assert_allclose(angle, expected, atol=2e-4 * np.abs(expected).max())


def test_the_attitude_rms_over_many_seeds_is_that_of_the_impulse_response():
    pole = first_order_pole(1.0)
    impulse = np.zeros(20000)
    impulse[0] = math.sqrt(1 - pole**2)
    rms = np.linalg.norm(lfilter(*disturbance_to_angle(), lfilter([1.0], [1.0, -pole], impulse)))
    found = []
    for seed in range(6):
        weather, vehicle = Weather(seed, 1.0, (0.0, 0.05, 0.0), 0.0), hovering()
        weather.begin(SEGMENT)
        rows = (weather.sample() for _ in range(10000))
        found += [vehicle.step(Surroundings(d), n, CorrectionInput()).attitude_error[1] for d, n in rows]
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(0.05 * rms, rel=0.1)


def test_gyro_noise_of_minus_68_decibel_watt_is_what_the_paper_says():
    assert noise_sigma(-68.0) == pytest.approx(3.98e-4, rel=1e-3)


def test_weather_repeats_itself_from_each_beginning_and_has_the_spectrum_it_names():
    weather = Weather(7, 1.0, (1.0, 2.0, 0.5), 3.98e-4)
    weather.begin(SEGMENT)
    first = [weather.sample() for _ in range(20000)]
    weather.begin(SEGMENT)
    assert [weather.sample() for _ in range(20000)] == first
    d, n = np.array([s[0] for s in first]), np.array([s[1] for s in first])
    np.testing.assert_allclose(d[1000:].std(axis=0), [1.0, 2.0, 0.5], rtol=0.25)
    np.testing.assert_allclose(n.std(axis=0), 3.98e-4, rtol=0.03)
    white = d[1:, 0] - first_order_pole(1.0) * d[:-1, 0]
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.02
    assert abs(np.corrcoef(d[:, 0], d[:, 1])[0, 1]) < 0.35


def test_calm_weather_has_noise_but_no_disturbance():
    weather = Weather(7, 1.0, (1.0, 1.0, 1.0), 1e-3)
    weather.begin(CALM)
    rows = [weather.sample() for _ in range(100)]
    assert all(d == (0.0, 0.0, 0.0) for d, _ in rows)
    assert np.std([n for _, n in rows]) > 5e-4


def test_take_off_reaches_its_altitude_and_landing_ends_disarmed_on_the_ground():
    vehicle, calm = hovering(), (STILL, (0.0, 0.0, 0.0))
    for _ in range(1000):
        vehicle.step(*calm, CorrectionInput())
    assert vehicle.airframe.altitude == pytest.approx(2.0, abs=0.01)
    vehicle.land()
    for _ in range(3000):
        vehicle.step(*calm, CorrectionInput())
    assert not vehicle.armed
    assert not vehicle.flying
    assert vehicle.airframe.altitude == 0.0


def test_an_armed_vehicle_stays_on_the_ground_until_it_is_sent_up():
    vehicle = Vehicle(linear())
    vehicle.arm()
    samples = [vehicle.step(Surroundings((0.5, 0.5, 0.5)), (1e-3, 0.0, 0.0), CorrectionInput()) for _ in range(500)]
    assert not vehicle.flying
    assert {s.u_e for s in samples} == {(0.0, 0.0, 0.0)}
    assert {s.rate for s in samples} == {(0.0, 0.0, 0.0)}
