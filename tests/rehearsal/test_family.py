"""The plants that stand for an uncertainty, against the factors that docs/robust.md writes down."""

import math
from pathlib import Path

import numpy as np
import pytest

from dob_companion.lti.response import response
from dob_companion.rehearsal.members import members, scenario_text
from dob_companion.synthesis import design_from_toml, parse_spec
from dob_companion.synthesis.robust.family import family

EXAMPLE = (Path(__file__).parents[2] / "examples" / "robust_pitch.toml").read_text(encoding="utf-8")
ANGLES = np.geomspace(1e-3, 3.0, 200)
Z = np.exp(1j * ANGLES)


def designed(uncertainty):
    head = EXAMPLE.partition("\n[block.uncertainty]")[0] + "\n"
    return design_from_toml(f'{head}[block.uncertainty]\nsynthesis = "nominal"\n{uncertainty}')


@pytest.fixture(scope="module")
def wide():
    return designed("gain = [0.7, 1.2]\npole = { nominal = 0.9447, range = [0.93, 0.96] }\ndelay_samples = [0, 2]")


def ratio(block, plant):
    """G_true / G over frequency."""
    model = response(block.problem.plant, ANGLES)[:, 0, 0]
    return response(plant, ANGLES)[:, 0, 0] / model


def test_each_end_of_each_interval_flies_and_the_worst_that_the_certificate_records(wide):
    (block,) = wide.blocks
    found = {each.name: each for each in family(block, wide.dt)}
    gain, pole, late = block.certificate.extra["robust_worst"][0]
    expected = {
        "nominal": np.ones(len(Z)),
        "gain low": np.full(len(Z), 0.7),
        "gain high": np.full(len(Z), 1.2),
        "pole low": (Z - 0.9447) / (Z - 0.93),
        "pole high": (Z - 0.9447) / (Z - 0.96),
        "delay": Z**-2,
        "worst": gain * (Z - 0.9447) / (Z - pole) * Z**-late,
    }
    assert list(found) == list(expected)
    for name, phi in expected.items():
        assert ratio(block, found[name].plant) == pytest.approx(phi, rel=1e-6), name
    assert found["delay"].changed == ("2 more samples of delay",)
    assert "gain ×0.7" in found["gain low"].changed[0]


def test_an_end_of_an_interval_that_is_the_model_itself_is_not_flown_again():
    design = designed("gain = [1.0, 1.2]")
    assert [each.name for each in family(design.blocks[0], design.dt)] == ["nominal", "gain high", "worst"]


def test_under_a_bound_over_frequency_the_worst_goes_to_the_bound_and_not_beyond():
    design = designed("frequency_hz = [0, 10, 50]\nmultiplicative = [0.1, 0.1, 0.4]")
    (block,) = design.blocks
    nominal, worst = family(block, design.dt)
    bound = np.interp(ANGLES / (2.0 * math.pi * design.dt), [0, 10, 50], [0.1, 0.1, 0.4])
    away = np.abs(ratio(block, worst.plant) - 1.0)
    assert np.all(away <= bound * (1.0 + 1e-6))
    assert np.max(away / bound) > 0.5
    assert ratio(block, nominal.plant) == pytest.approx(1.0)


def test_members_differ_in_the_plant_alone(wide):
    gains = {"roll": 6.5, "pitch": 5.0, "yaw": 2.0}
    found = members(wide, gains)
    assert found[0].name == "nominal"
    for member in found:
        (block,) = member.aircraft["blocks"]
        assert block["axes"] == ["pitch"]
        assert block["problem"]["controller"]["A"] == wide.blocks[0].problem.controller.A.tolist()
        assert member.aircraft["attitude_gain"] == gains
    assert found[0].aircraft["blocks"][0]["problem"]["plant"]["A"] == wide.blocks[0].problem.plant.A.tolist()


def test_the_weather_is_that_of_the_specs_auto_table(wide):
    text = EXAMPLE.partition("[[block]]")[0]
    auto = "[auto]\ndisturbance_corner_hz = 2.5\nnoise_rms = 1e-2\nleast_disk_margin = 0.5\n[[block]]"
    spec = parse_spec(text.partition("[auto]")[0] + auto + EXAMPLE.partition("[[block]]")[2])
    assert "noise_dbw = -40\n" in scenario_text(wide, spec)
    assert "bandwidth_hz = 2.5\n" in scenario_text(wide, spec)
    assert "noise_dbw = -68\n" in scenario_text(wide, None)
