"""What a certificate says of the attenuation in a stated weather, and that `inspect` believes none of it."""

from dataclasses import replace

import control as ct
import numpy as np
import pytest

from dob_companion.analysis.attained import attained, attained_words
from dob_companion.artifact import dumps, loads
from dob_companion.comparison.flight import expect
from dob_companion.comparison.vehicle import close, no_observer
from dob_companion.lti.response import response
from dob_companion.report.attained_bar import WIDTH, attained_bar
from dob_companion.report.design_page import design_page
from dob_companion.synthesis import parse_spec, verify
from dob_companion.synthesis.design import assembled, design_block, with_attenuation
from dob_companion.synthesis.optimal import bound
from dob_companion.synthesis.optimal.reached import _taken
from dob_companion.synthesis.plant.models import from_data
from dob_companion.synthesis.spec.parse import Model, Weight, Zpk
from tests.report.material import coupled_design
from tests.synthesis.optimal.axes import EXAMPLES, NOISE, vehicle_of

RMS = 0.0557
WEATHER = f"""
[auto]
disturbance_corner_hz = 1.0
disturbance_rms = {RMS}
noise_rms = {NOISE}
least_disk_margin = 0.4
largest_noise_in_correction = 3.0e-4
"""


SEARCHED = (Zpk((0.754, 0.754), (0.97986, 0.97986), 0.48252), Zpk((0.195,), (-0.345,), 1.0155))
"""Weights of pitch that a search by hand has found: good, and not the best that there are."""


def spec_of(weather):
    """Pitch with these weights."""
    spec = parse_spec((EXAMPLES / "tailsitter_paper.toml").read_text(encoding="utf-8") + weather)
    W_d, W_n = (Weight("searched", Model(form, "searched")) for form in SEARCHED)
    (pitch,) = (block for block in spec.blocks if block.name == "pitch")
    return replace(spec, blocks=(replace(pitch, disturbance=W_d, noise=W_n),))


def designed(weather):
    spec = spec_of(weather)
    return assembled(spec, (design_block(spec.blocks[0], spec.dt),))


@pytest.fixture(scope="module")
def pitch():
    return designed(WEATHER)


def test_what_readings_of_the_moment_miss_is_that_of_the_loop_that_they_close():
    block = designed(WEATHER + "moment_rate_hz = 180.0\n").blocks[0]
    vehicle, D = vehicle_of("pitch"), from_data(block.observer, 0.004)
    angles = np.linspace(1e-3, np.pi, 4000)
    G, C = (np.squeeze(response(each, angles)) for each in (vehicle.plant, vehicle.controller))
    D_y, D_u = response(D, angles)[:, 0].T
    late = np.exp(-1j * vehicle.delay * angles)
    back = late * D_u / (1.0 + late * D_u + (C + late * D_y) * G)
    expected = np.max(np.abs(back) * (1.0 - np.sinc(angles / (2.0 * np.pi * 0.004 * 180.0)) ** 2))
    assert block.certificate.extra["misreading"] == pytest.approx(expected, rel=1e-3)


def test_the_attenuation_is_that_of_the_closed_loops_lyapunov_equations_at_every_gain(pitch):
    block, extra = pitch.blocks[0], pitch.blocks[0].certificate.extra
    observer = from_data(block.observer, pitch.dt)
    told = {1.0: extra["attenuation"], **{float(g): v for g, v in extra["attenuation_at_gains"].items()}}
    for gain, value in told.items():
        vehicle = vehicle_of("pitch").with_gain(gain)
        off, on = (expect(close(vehicle, each), RMS).attitude for each in (no_observer(pitch.dt), observer))
        assert value == pytest.approx(off / on, rel=1e-3)
    assert set(told) == {0.7, 1.0, 1.3}


def test_the_limit_is_what_an_independent_study_found_at_the_limits_that_the_spec_states(pitch):
    extra = pitch.blocks[0].certificate.extra
    assert extra["attenuation_limit"] == pytest.approx(17.70, rel=0.01)
    assert extra["attenuation_limit_at"] == {"disk_margin": 0.4, "noise": 3.0e-4}


def test_inspect_finds_the_same_numbers_from_the_file_alone(pitch):
    again = {finding.name: finding for finding in verify(loads(dumps(pitch)[0]))}
    assert all(finding.agrees for finding in again.values())
    assert {"attenuation", "attenuation_at_0.7", "attenuation_at_1.3", "attenuation_limit"} <= set(again)


@pytest.mark.parametrize("forged", [{"attenuation": 17.0}, {"attenuation_limit": 15.5}, {"attenuation_for": None}])
def test_inspect_believes_no_number_that_the_matrices_do_not_have(pitch, forged):
    block = pitch.blocks[0]
    extra = {k: v for k, v in (dict(block.certificate.extra) | forged).items() if v is not None}
    changed = replace(block, certificate=replace(block.certificate, extra=extra))
    assert not all(finding.agrees for finding in verify(replace(pitch, blocks=(changed,))))


def test_an_observer_that_takes_more_than_the_spec_allows_is_held_against_others_that_take_as_much():
    strict = WEATHER.replace("least_disk_margin = 0.4", "least_disk_margin = 0.8").replace("3.0e-4", "1.0e-5")
    extra = designed(strict).blocks[0].certificate.extra
    assert extra["attenuation_limit_at"]["disk_margin"] == pytest.approx(0.4002, rel=1e-3)
    assert extra["attenuation"] < extra["attenuation_limit"]


def test_a_spec_that_states_no_weather_is_told_no_attenuation():
    assert not [name for name in designed("").blocks[0].certificate.extra if name in ("attenuation_for", "attenuation")]


def test_an_attitude_loop_that_is_unstable_leaves_the_certificate_and_a_reason():
    extra = designed(WEATHER + "attitude_gain = 200.0\n").blocks[0].certificate.extra
    assert "unstable" in extra["attenuation_absent"]
    assert not {"attenuation", "attenuation_limit"} & set(extra)


def test_coupled_axes_have_a_limit_too(monkeypatch):
    monkeypatch.setattr(bound, "EVALUATED", 2**11)
    coupled = coupled_design()
    block = with_attenuation(coupled.blocks[0], coupled.dt, spec_of(WEATHER).auto)
    extra = block.certificate.extra
    assert 1.0 < extra["attenuation"] < extra["attenuation_limit"]
    # Its weights ask for less than [auto] allows of the noise and for more of the margin.
    assert extra["attenuation_limit_at"]["disk_margin"] == pytest.approx(block.certificate.disk_margin)
    assert extra["attenuation_limit_at"]["noise"] == pytest.approx(3.0e-4)


def test_of_several_moments_the_noisiest_and_of_several_directions_the_loudest_count():
    """A direct path from each of two rates to both moments: row norms 0.5 and 5, largest singular value 5."""
    D = np.hstack([[[0.3, 0.4], [4.0, -3.0]], np.zeros((2, 2))])
    auto = replace(spec_of(WEATHER + "largest_noise_gain = 1.0\n").auto, noise_rms=1e-3)
    taken = _taken(ct.ss([], [], [], D, 0.004), 2, auto, 0.5)
    assert taken.noise == pytest.approx(5e-3)
    assert taken.peak == pytest.approx(5.0)
    assert taken.disk_margin == 0.4


def test_it_is_told_in_words_and_drawn_as_one_bar_that_ends_where_every_observer_does(pitch):
    block = pitch.blocks[0]
    assert "15.4 times smaller. No observer with a disk margin of 0.4" in attained_words(block, pitch.dt)
    bar = attained_bar("b0-attained", attained(block, pitch.dt))
    assert bar.limit == WIDTH
    assert bar.reached == pytest.approx(
        WIDTH * (15.43 - 1.0) / (block.certificate.extra["attenuation_limit"] - 1.0), 1e-3
    )
    page = design_page(pitch)
    assert "87 % of what is possible" in page
    assert 'class="attained"' in page
