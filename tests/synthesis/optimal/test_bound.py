"""The bound on every observer: its reference values, an independent program below it, and nothing above it."""

from dataclasses import replace

import control as ct
import numpy as np
import pytest

from dob_companion.comparison.at_price import AtPrice
from dob_companion.comparison.flight import expect
from dob_companion.comparison.measure import LoopResponses
from dob_companion.comparison.vehicle import ATTITUDE_GAIN, Vehicle, close, no_observer
from dob_companion.lti.response import spectral_radius
from dob_companion.synthesis.optimal.bound import AttenuationLimits, Dual, Ground, attenuation_limit
from dob_companion.synthesis.optimal.problem import Block, Spectrum, Wanted
from dob_companion.synthesis.spec.spectrum import LowPass
from tests.synthesis.optimal.axes import NOISE, single_of, vehicle_of, weather_of

SHIPPED = {"pitch": (0.400, 3.00e-4), "roll": (0.412, 1.08e-3), "yaw": (0.882, 4.11e-4)}
"""Disk margin and noise in the correction of the tuned specs that come from a search of weights."""


def wanted(name, **other):
    margin, noise = SHIPPED[name]
    return Wanted(disk_margin=margin, noise=noise, noise_rms=NOISE, **other)


def best_of_high_order(vehicle, rms, margin, noise):
    """What `comparison.at_price` attains, by the Lyapunov equations of its closed loop."""
    observer = AtPrice(vehicle, rms).best(margin, noise)
    off, on = (expect(close(vehicle, each), rms) for each in (no_observer(vehicle.dt), observer))
    return off.attitude / on.attitude, LoopResponses(vehicle).disk_margin(observer), on.noise_in_correction


@pytest.mark.parametrize(("name", "limit"), [("pitch", 17.70), ("roll", 20.41), ("yaw", 33.40)])
def test_it_is_what_an_independent_study_found_on_every_axis(name, limit):
    assert attenuation_limit(single_of(name), weather_of(name, seeds=20), wanted(name)) == pytest.approx(
        limit, rel=0.01
    )


def test_an_observer_of_order_sixty_four_lies_below_it_and_within_a_percent():
    vehicle, weather = vehicle_of("pitch"), weather_of("pitch", seeds=20)
    reached, margin, noise = best_of_high_order(vehicle, weather.rms, *SHIPPED["pitch"])
    paid = replace(wanted("pitch"), disk_margin=margin, noise=noise)
    limit = attenuation_limit(single_of("pitch"), weather, paid)
    assert 0.99 * limit <= reached <= limit


@pytest.mark.parametrize("seed", range(4))
def test_no_observer_of_a_random_plant_exceeds_it(seed):
    rng = np.random.default_rng(seed)
    vehicle = random_vehicle(rng)
    rms, noise = float(rng.uniform(0.02, 0.1)), float(10.0 ** rng.uniform(-3.5, -2.5))
    reached, margin, heard = best_of_high_order(vehicle, rms, float(rng.uniform(0.2, 0.5)), noise)
    limits = Wanted(disk_margin=margin, noise=heard, noise_rms=NOISE)
    block = Block(vehicle.plant, vehicle.controller, (vehicle.delay,), ATTITUDE_GAIN)
    limit = attenuation_limit(block, Spectrum(LowPass(1.0), rms), limits)
    assert reached <= limit * (1.0 + 1e-4)
    assert reached >= 0.9 * limit  # and it says something


def random_vehicle(rng):
    """A lag, perhaps an integrator, a zero in or outside the circle; a controller that holds it well."""
    dt = 0.004
    while True:
        lag, zero = np.exp(-dt * rng.uniform(5.0, 40.0)), rng.choice([-1.5, 0.3, 2.5]) * rng.uniform(0.8, 1.2)
        poles = [1.0 if rng.random() < 0.5 else np.exp(-dt * rng.uniform(0.1, 2.0)), lag]
        gain = rng.uniform(0.1, 0.4) * np.sign(1.0 - zero) / max(1.0, abs(zero))
        plant = ct.ss(ct.zpk([zero], poles, gain, dt=dt))
        controller = ct.ss(ct.zpk([0.85, 0.9985], [0.0, 1.0], rng.uniform(0.3, 0.8), dt=dt))
        vehicle = Vehicle(plant, controller, int(rng.integers(0, 4)))
        radius = spectral_radius(close(vehicle, no_observer(dt)).A)
        if radius < 0.9999 and LoopResponses(vehicle).disk_margin(no_observer(dt)) > 0.6:
            return vehicle


def test_it_holds_for_any_multipliers_at_all():
    ground = Ground(single_of("pitch"), weather_of("pitch"), NOISE, 2**12)
    dual = Dual(ground, wanted("pitch"))
    best = dual.value(dual.best())[0]
    rng = np.random.default_rng(1)
    for size in (1e-6, 1e-4, 1e-2):
        assert dual.value(size * rng.random(dual.size))[0] <= best * (1.0 + 1e-4)


def test_its_slope_is_that_of_its_values():
    dual = Dual(Ground(single_of("yaw"), weather_of("yaw"), NOISE, 2**12), wanted("yaw", peak=0.8))
    rng = np.random.default_rng(2)
    at = 1e-4 * rng.random(dual.size)
    to = at * rng.standard_normal(dual.size)
    up, down = (dual.value(at + sign * 1e-4 * to)[0] for sign in (1.0, -1.0))
    assert dual.value(at)[1] @ to == pytest.approx((up - down) / 2e-4, rel=1e-5)


def test_stricter_limits_never_leave_more():
    limits = AttenuationLimits(single_of("roll"), weather_of("roll"), NOISE)
    asked = wanted("roll")
    found = [limits.of(replace(asked, disk_margin=share * asked.disk_margin)) for share in (0.75, 1.0, 1.25)]
    quieter = limits.of(replace(asked, noise=0.5 * asked.noise))
    muted = limits.of(replace(asked, peak=1.0))
    assert found[0] > found[1] > found[2]
    assert max(quieter, muted) < found[1]


def test_a_search_begun_elsewhere_ends_at_the_same_bound():
    block, weather = single_of("pitch"), weather_of("pitch")
    limits = AttenuationLimits(block, weather, NOISE)
    limits.of(replace(wanted("pitch"), disk_margin=0.6))
    assert limits.of(wanted("pitch")) == pytest.approx(attenuation_limit(block, weather, wanted("pitch")), rel=5e-4)
