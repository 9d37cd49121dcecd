"""`design` as a user meets it: files, exit codes, one line on stderr."""

import json
from pathlib import Path

import numpy as np
import pytest

from dob_companion.artifact import check_flyable, loads
from dob_companion.cli.main import main
from tests.synthesis import paper

AUTO = Path(__file__).parents[2] / "examples" / "tailsitter_auto.toml"


def test_design_writes_a_flyable_file_and_prints_its_certificate(tmp_path, capsys):
    out = tmp_path / "new" / "dir"
    assert main(["design", str(paper.SPEC), "-o", str(out)]) == 0
    design = loads((out / "design.json").read_text(encoding="utf-8"))
    check_flyable(design, 250.0)
    assert "<html" in (out / "report.html").read_text(encoding="utf-8")
    shown = capsys.readouterr().out
    assert "gamma_star (lower bound)      1.59982   1.84861   1.50757" in shown
    assert design.sha256[:8] in shown


def test_design_prints_json_on_request(tmp_path, capsys):
    (spec := tmp_path / "pitch.toml").write_text(paper.spec_text().partition("# Roll and yaw")[0], encoding="utf-8")
    assert main(["design", str(spec), "-o", str(tmp_path), "--json"]) == 0
    certificates = json.loads(capsys.readouterr().out)
    assert certificates["pitch"]["gamma_star"] == pytest.approx(1.59982, rel=1e-4)


@pytest.mark.parametrize(
    ("old", "new", "code", "words"),
    [
        ("rate_hz", "rate_Hz", 2, "unknown key 'rate_Hz'; did you mean 'rate_hz'?"),
        ("gain = 0.14131 ", "gain = nan ", 2, "block 'pitch': plant: gain: expected a finite number"),
        ("gain = 0.9002", "gain = -0.9002", 1, "block 'pitch': baseline loop of pitch"),
        ("poles = [1.0, 0.9447]", "poles = [1.0, 9.447]", 1, "outside what the rate can carry"),
        ("poles = [0.9962]", "poles = [1.0]", 1, "block 'pitch': disturbance weight: mode z = 1"),
    ],
)
def test_bad_specs_end_with_one_line_and_no_file(old, new, code, words, tmp_path, capsys):
    path, out = tmp_path / "my.toml", tmp_path / "out"
    path.write_text(paper.spec_text().replace(old, new, 1), encoding="utf-8")
    assert main(["design", str(path), "-o", str(out)]) == code
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert str(path) in error
    assert words in error
    assert not out.exists()


def test_a_spec_that_is_not_there_ends_with_two(tmp_path, capsys):
    assert main(["design", str(tmp_path / "none.toml"), "-o", str(tmp_path)]) == 2
    assert "none.toml" in capsys.readouterr().err


@pytest.mark.parametrize("order", ["0", "-1", "1.5", "three"])
def test_an_order_that_is_none_says_what_was_expected(order, tmp_path, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["design", str(paper.SPEC), "-o", str(tmp_path), "--order", order])
    assert ended.value.code == 2
    assert f"argument --order: {order!r}, expected a whole number of 1 or more" in capsys.readouterr().err


@pytest.mark.parametrize(("command", "more"), [("report", " or a design.json"), ("replay", "")])
def test_a_telemetry_log_is_called_one(command, more, tmp_path, capsys):
    log = tmp_path / "x.tlog"
    log.write_bytes(b"\x00\x06\x10\x11\x12\x13\x14\x15\xfd" + bytes(40))
    assert main([command, str(log), *(["-o", str(tmp_path / "page.html")] if more else [])]) == 2
    expected = f"{log}: a telemetry log, expected a recorded flight (flight-NNNN-NNN.dobtrace){more}"
    assert capsys.readouterr().err == f"dob-companion: {expected}\n"
    assert [path.name for path in tmp_path.iterdir()] == ["x.tlog"]


def test_a_place_that_cannot_be_written_is_said_before_the_work(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    for command in ("design", "compare"):
        assert main([command, str(paper.SPEC), "-o", str(tmp_path / "file" / "out")]) == 2
        assert "is not a directory" in capsys.readouterr().err


def test_an_auto_table_that_is_missing_is_told_what_it_holds(tmp_path, capsys):
    assert main(["design", str(paper.SPEC), "-o", str(tmp_path / "out"), "--auto"]) == 2
    said = capsys.readouterr().err
    for key in ("'auto' is missing", "disturbance_band_hz", "noise_rms", "least_disk_margin"):
        assert key in said
    assert not (tmp_path / "out").exists()


def test_auto_reads_the_model_files_that_a_spec_names(tmp_path, capsys):
    """Told by what it says of a file whose sample time is another than the spec's."""
    spec, out = tmp_path / "my.toml", tmp_path / "out"
    np.savez(tmp_path / "pitch.npz", A=[[0.5]], B=[[1.0]], C=[[1.0]], D=[[0.0]], Ts=0.01)
    roots = "[block.plant]\nzeros = [-1.716]\npoles = [1.0, 0.9447]\ngain = 0.14131\n"
    text = AUTO.read_text(encoding="utf-8")
    assert roots in text
    spec.write_text(text.replace(roots, '[block.plant]\nfile = "pitch.npz"\n'), encoding="utf-8")
    assert main(["design", str(spec), "-o", str(out), "--auto"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "pitch.npz" in said
    assert "0.01" in said
    assert not out.exists()
