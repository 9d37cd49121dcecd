"""The air: Dryden turbulence against its formulas, and the discrete gust's shape."""

from math import pi, sqrt

import numpy as np
import pytest

from sitl.weather.gusts import Air, Dryden, Gust, Longitudinal, Transverse, Wind, low_altitude

DT = 0.004
FOOT = 0.3048


def test_scale_lengths_and_intensities_are_the_standard_s_at_a_hundred_feet():
    air = low_altitude(100.0 * FOOT, 10.0)
    k = 0.177 + 0.0823
    assert air.length_w == pytest.approx(100.0 * FOOT)
    assert air.length_u == pytest.approx(100.0 * FOOT / k**1.2)
    assert (air.sigma_w, air.sigma_u) == pytest.approx((1.0, 1.0 / k**0.4))


def test_below_ten_feet_the_air_is_that_of_ten_feet():
    assert low_altitude(1.0, 10.0) == low_altitude(10.0 * FOOT, 10.0)


@pytest.mark.parametrize("tau", [0.02, 0.5])
def test_the_sampled_noise_has_unit_variance_and_the_spectrum_of_its_form(tau):
    """Averaged periodogram against |H|² of the continuous form, between two frequencies well below Nyquist."""
    rng = np.random.default_rng(3)
    along, across = Longitudinal(tau, DT), Transverse(tau, DT)
    draws = rng.standard_normal((2**17, 3)).tolist()
    u = np.array([along.step(a) for a, _, _ in draws])
    v = np.array([across.step(b, c) for _, b, c in draws])
    assert (u.std(), v.std()) == pytest.approx((1.0, 1.0), rel=0.08)
    n = 4096
    f = np.fft.rfftfreq(n, DT)
    band = (f > 0.5) & (f < 20.0)
    s = 2j * pi * f[band] * tau
    forms = 4.0 * tau / abs(1.0 + s) ** 2, 2.0 * tau * abs(1.0 + sqrt(3.0) * s) ** 2 / abs(1.0 + s) ** 4
    for signal, form in zip((u, v), forms, strict=True):
        pieces = signal.reshape(-1, n) * np.hanning(n)
        density = 2.0 * DT * (abs(np.fft.rfft(pieces)) ** 2).mean(axis=0)[band] / (np.hanning(n) ** 2).sum()
        assert np.mean(density / form) == pytest.approx(1.0, abs=0.06)


def test_turbulence_has_the_intensities_asked_for():
    air = low_altitude(2.0, 7.7)
    dryden = Dryden(air, 8.0, 0.9, DT)
    rows = np.random.default_rng(4).standard_normal((150_000, 6)).tolist()
    found = np.array([np.ravel(dryden.step(row)) for row in rows]).std(axis=0)
    assert found[:3] == pytest.approx((air.sigma_u, air.sigma_u, air.sigma_w), rel=0.1)
    variance = air.sigma_w**2 / air.length_w * 0.8 * (pi * air.length_w / 3.6) ** (1 / 3) * pi**2 / 7.2
    assert found[3] == pytest.approx(sqrt(variance), rel=0.05)


def test_a_gust_rises_as_one_minus_cosine_stays_and_falls_as_it_rose():
    gust = Gust(at_s=2.0, rise_s=1.0, hold_s=3.0, peak=(1.0, 0.0, 0.0))
    expected = {1.9: 0.0, 2.5: 0.5, 3.0: 1.0, 5.9: 1.0, 6.5: 0.5, 7.1: 0.0}
    assert {t: gust.share(t) for t in expected} == pytest.approx(expected)


def test_the_air_comes_up_within_the_lead_and_blows_from_where_it_says():
    air = Air(Wind(mean=4.0, from_deg=90.0, turbulence=0.0, span_m=1.0), 1, 2.0, lead_s=1.0, dt=DT)
    air.begin(1)
    wind = [air.sample()[0] for _ in range(500)]
    assert wind[0] == pytest.approx((0.0, 0.0, 0.0))
    assert wind[125] == pytest.approx((0.0, -2.0, 0.0), abs=1e-12)
    assert wind[-1] == pytest.approx((0.0, -4.0, 0.0))


def test_the_same_seed_and_segment_bring_the_same_air():
    def air(seed: int) -> list:
        a = Air(Wind(4.0, 0.0, 7.7, 0.9), seed, 2.0, 0.0, DT)
        a.begin(1)
        return [a.sample() for _ in range(2000)]

    assert air(1) == air(1)
    assert air(1) != air(2)
