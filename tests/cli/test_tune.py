"""`dob-companion tune` ends at the first doubt."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from dob_companion.cli import design, identifying
from dob_companion.cli.main import main
from tests.companion.aircraft import small_design


def of(stable):
    """A design whose pitch is proved robust or not; roll states no uncertainty."""
    whole = small_design(axes=("roll", "pitch"))
    blocks = [
        replace(block, certificate=replace(block.certificate, extra=extra))
        for block, extra in zip(whole.blocks, ({}, {"robust_stable": stable}), strict=True)
    ]
    return replace(whole, blocks=tuple(blocks))


@pytest.fixture
def tuned(monkeypatch, tmp_path, capsys):
    """Runs `tune --log` with what is identified and designed given; its exit code and what it said last."""

    def run(made):
        outcome = SimpleNamespace(spec="", why="", write=lambda _: [], to_object=dict)
        monkeypatch.setattr(identifying, "of_logs", lambda *_: outcome)
        monkeypatch.setattr(identifying, "table", lambda _: "")
        monkeypatch.setattr(design, "design_into", lambda *_, **__: (made, ()))
        monkeypatch.setattr(design, "certificate_text", lambda *_: "")
        code = main(["tune", "--log", "flight.bin", "-o", str(tmp_path / "out"), "--no-rehearsal"])
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


def test_a_design_that_is_not_proved_over_its_uncertainty_is_not_offered(tuned):
    code, out, err = tuned(of(stable=False))
    assert code == 1
    assert "not proved stable for all that is not known of pitch" in err
    assert "it flies with" not in out


def test_one_that_is_proved_is(tuned):
    code, out, _ = tuned(of(stable=True))
    assert code == 0
    assert "it flies with: dob-companion run --design" in out
