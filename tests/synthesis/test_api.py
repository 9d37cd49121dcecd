"""`synthesize` as a program calls it: what it refuses, what it prints, and the way to a file that flies."""

import re
from pathlib import Path

import control as ct
import numpy as np
import pytest

from dob_companion.artifact import check_flyable, loads
from dob_companion.errors import DesignFileError, DobError, SpecError, UnsolvableError
from dob_companion.report.chart import Curve
from dob_companion.synthesis import design_json, synthesize, verify
from dob_companion.synthesis.numeric import numbers_judged
from tests.synthesis import paper
from tests.synthesis.problems import static

GIVEN = {"plant": paper.PLANT, "controller": paper.PID, "disturbance_weight": paper.W_D, "noise_weight": paper.W_N}


def made(**changes):
    return synthesize(**(GIVEN | changes))


@pytest.fixture(scope="module")
def pitch():
    return made(axes=("pitch",))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"delay_samples": 2.0}, r"delay_samples: 2\.0, expected a whole number"),
        ({"delay_samples": True}, "delay_samples: True, expected a whole number"),
        ({"delay_samples": "1"}, "delay_samples: '1', expected a whole number"),
        ({"delay_samples": None}, "delay_samples: None, expected a whole number"),
        ({"delay_samples": 31}, r"delay_samples: \[31\], expected 1 of 0 or more, at most 30"),
        ({"delay_samples": 10**40}, "expected 1 of 0 or more, at most 30"),
        ({"noise_weight": 0.01}, r"noise weight: 0\.01 is a number, expected a discrete StateSpace"),
        ({"plant": np.eye(1)}, "plant: got ndarray, expected a discrete StateSpace"),
        ({"plant": ct.tf([1.0], [1.0, 1.0])}, r"plant: continuous \(dt is 0\).*sample_system"),
        ({"plant": ct.ss(0.5, 1.0, 1.0, 0.0, True)}, "plant: dt is True, expected its sample time in s"),
        ({"controller": ct.ss(0.5, 1.0, 1.0, 0.0, None)}, "controller: dt is None, expected its sample time"),
        ({"plant": ct.ss(np.nan, 1.0, 1.0, 0.0, paper.DT)}, "plant: holds a number that is not finite"),
        (
            {"disturbance_weight": ct.tf([1.0, 0.0, 0.0], [1.0, 0.5], paper.DT)},
            "disturbance weight: has no state space",
        ),
        ({"gamma_backoff": 1.0}, r"gamma_backoff: 1\.0, expected a number above 1"),
        ({"largest_order": 0}, "largest_order: 0, expected a whole number of 1 or more"),
        ({"largest_order": 2.5}, r"largest_order: 2\.5, expected a whole number"),
        ({"axes": ("roll", "pitch")}, r"axes: \('roll', 'pitch'\), expected a name for each of 1 moments"),
        ({"uncertainty": {"gain": [0.7, 1.3]}}, "uncertainty: got dict, expected an Uncertainty"),
        (
            {"plant": paper.PLANT * ct.tf([1.0], [1.0] + [0.0] * 70, paper.DT)},
            "have order 7. together, expected at most 40",
        ),
    ],
)
def test_an_argument_of_the_wrong_kind_is_refused_in_one_line(changes, words):
    with pytest.raises(SpecError, match=words) as caught:
        made(**changes)
    assert "\n" not in str(caught.value)


def test_transfer_functions_and_numpys_whole_numbers_do_as_well(pitch):
    G = ct.tf([0.14131, 0.14131 * 1.716], [1.0, -1.9447, 0.9447], paper.DT)
    proof = made(plant=G, delay_samples=np.int64(1)).certificate
    assert proof.gamma_star == pytest.approx(pitch.certificate.gamma_star, rel=1e-5)


def test_a_result_prints_as_the_table_of_the_command(pitch):
    lines = str(pitch).splitlines()
    assert lines[0].split() == ["250", "Hz,", "delay", "1", "pitch"]
    assert lines[2].split() == ["gamma", "(measured)", f"{pitch.certificate.gamma:.5f}"]
    assert len(lines) == 13
    assert max(map(len, lines)) < 80


def test_one_call_leads_from_a_result_to_a_design_that_flies(pitch):
    design = loads(design_json(pitch, created="2026-01-01T00:00:00+00:00"))
    check_flyable(design, 250.0)
    assert design.blocks[0].axes == ("pitch",)
    assert all(finding.agrees for finding in verify(design))


def test_the_page_of_the_api_prints_what_it_says(tmp_path, monkeypatch, capsys):
    page = (Path(__file__).parents[2] / "docs" / "api.md").read_text(encoding="utf-8")
    code, shown = re.search(r"```python\n(.*?)```\n\nprints\n\n```\n(.*?)```", page, re.DOTALL).groups()
    monkeypatch.chdir(tmp_path)
    exec(code, {})
    for said, line in zip(capsys.readouterr().out.splitlines(), shown.splitlines(), strict=True):
        *label, value = said.split()
        *wanted, number = line.split()
        assert label == wanted
        if label and label[0] != "250" and label[0] != "command":
            assert float(value) == pytest.approx(float(number), rel=1e-3)
    check_flyable(loads((tmp_path / "design.json").read_text(encoding="utf-8")), 250.0)


def test_results_of_several_axes_become_blocks_of_one_design(pitch):
    design = loads(design_json(pitch, made(axes=("roll",), delay_samples=2)))
    assert [block.axes for block in design.blocks] == [("pitch",), ("roll",)]
    assert [block.delay_samples for block in design.blocks] == [1, 2]
    assert design.delay_samples == 2


def test_a_result_that_cannot_fly_says_why(pitch):
    with pytest.raises(SpecError, match=r"axes: None, expected different ones of roll, pitch, yaw"):
        design_json(made())
    with pytest.raises(SpecError, match=r"axes \['pitch', 'pitch'\] .* expected each axis once"):
        design_json(pitch, pitch)
    with pytest.raises(SpecError, match="expected each axis once"):
        design_json()
    hot = made(plant=paper.PLANT * 3.8, axes=("pitch",))
    assert hot.certificate.disk_margin < 0.2
    with pytest.raises(DesignFileError, match=r"block 'pitch': disk_margin is 0\.\d+, expected at least 0.2"):
        design_json(hot)


@pytest.mark.parametrize("scale", [1e-8, 1e8, 1e-12])
def test_units_do_not_matter_even_where_they_are_absurd(scale, pitch):
    """The same loop with rates in other units: same observer, same certificate."""
    plant, controller, noise = paper.PLANT * scale, paper.PID * (1.0 / scale), paper.W_N * scale
    proof = made(plant=plant, controller=controller, noise_weight=noise).certificate
    for name in ("gamma", "gamma_star", "disk_margin", "closed_loop_spectral_radius", "estimation_bandwidth_hz"):
        assert getattr(proof, name) == pytest.approx(getattr(pitch.certificate, name), rel=1e-4), name


def test_what_a_library_raises_over_numbers_becomes_one_refusal_with_its_cause():
    with (
        pytest.raises(UnsolvableError, match=r"^pitch: no answer in double precision \(Singular matrix\)") as caught,
        numbers_judged("pitch"),
    ):
        np.linalg.inv(np.zeros((2, 2)))
    assert isinstance(caught.value.__cause__, np.linalg.LinAlgError)


@pytest.mark.parametrize("fault", [SpecError("mine"), TypeError("a fault of the program")])
def test_what_is_no_trouble_with_numbers_stays_what_it_is(fault):
    with pytest.raises(type(fault)) as caught, numbers_judged("pitch"):
        raise fault
    assert caught.value is fault


def test_a_value_error_of_this_package_is_no_refusal():
    with pytest.raises(ValueError, match="curve") as caught, numbers_judged("pitch"):
        Curve("curve", np.zeros(2), np.zeros(3), "on")
    assert not isinstance(caught.value, DobError)


def test_delays_of_several_moments_are_one_each():
    none, one = static(np.zeros((2, 2))), static(np.eye(2))
    with pytest.raises(SpecError, match=r"delay_samples: \[1, 2, 3\], expected 2 of 0 or more"):
        synthesize(ct.append(paper.PLANT, paper.PLANT), none, one, one, delay_samples=(1, 2, 3))
