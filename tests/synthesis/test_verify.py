import json
from dataclasses import replace

import numpy as np
import pytest

from dob_companion.artifact import DobDesign, StateSpaceData, dumps, loads
from dob_companion.cli.main import main
from dob_companion.errors import NotCertifiedError
from dob_companion.synthesis import design_from_toml, verify
from tests.synthesis import paper


@pytest.fixture(scope="module")
def design():
    return design_from_toml(paper.spec_text(), created="2030-01-01T00:00:00+00:00")


def altered(design, **block_changes) -> DobDesign:
    first, *rest = design.blocks
    return replace(design, blocks=(replace(first, **block_changes), *rest))


def test_a_design_verifies_from_its_file_alone(design):
    findings = verify(loads(dumps(design)[0]))
    assert all(finding.agrees for finding in findings)
    assert {finding.block for finding in findings} == {"pitch", "roll", "yaw"}
    for name in ("gamma", "gamma_star", "disk_margin", "command_leak", "delay_margin_samples"):
        assert sum(finding.name == name for finding in findings) == 3


def test_the_same_spec_gives_the_same_file(design):
    again = design_from_toml(paper.spec_text(), created=design.created)
    assert dumps(again)[0] == dumps(design)[0]


def test_a_nicer_number_in_the_certificate_is_found_out(design):
    proof = replace(design.blocks[0].certificate, disk_margin=0.9)
    wrong = [f for f in verify(altered(design, certificate=proof)) if not f.agrees]
    assert [(f.block, f.name, f.recorded) for f in wrong] == [("pitch", "disk_margin", 0.9)]


def test_a_raised_gamma_star_is_found_out(design):
    proof = design.blocks[0].certificate
    wrong = [
        f
        for f in verify(altered(design, certificate=replace(proof, gamma_star=1.002 * proof.gamma_star)))
        if not f.agrees
    ]
    assert [(f.block, f.name) for f in wrong] == [("pitch", "gamma_star")]
    assert wrong[0].measured == pytest.approx(proof.gamma_star)


def test_an_altered_observer_is_found_out(design):
    old = design.blocks[0].observer
    with pytest.raises(NotCertifiedError, match="block 'pitch': measured gamma"):
        verify(altered(design, observer=StateSpaceData(old.A, 1.1 * np.asarray(old.B), old.C, old.D)))


def test_inspect_says_verified_and_fails_on_a_wrong_number(design, tmp_path, capsys):
    good, bad = tmp_path / "design.json", tmp_path / "bad.json"
    good.write_text(dumps(design)[0], encoding="utf-8")
    assert main(["inspect", str(good)]) == 0
    assert "verified" in capsys.readouterr().out
    proof = replace(design.blocks[0].certificate, gamma=1.5)
    bad.write_text(dumps(altered(design, certificate=proof))[0], encoding="utf-8")
    assert main(["inspect", str(bad), "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert report["verified"] is False
    assert [f["name"] for f in report["findings"] if not f["agrees"]] == ["gamma"]


def test_inspect_of_a_hand_edited_file_ends_with_two(design, tmp_path, capsys):
    path = tmp_path / "design.json"
    path.write_text(dumps(design)[0].replace('"dt": 0.004', '"dt": 0.005'), encoding="utf-8")
    assert main(["inspect", str(path)]) == 2
    assert "sha256" in capsys.readouterr().err
