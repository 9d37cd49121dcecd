"""Whatever spec comes, `design` ends with a certified design or with one line, and never leaves half of anything."""

import warnings
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dob_companion.artifact import loads
from dob_companion.cli.main import main
from dob_companion.synthesis import verify
from tests.synthesis import paper
from tests.synthesis.specs import random_spec

WHOLE = ["design.json", "figures", "report.html"]


def designed(text, command="design"):
    """Exit code, stderr, and what stands in the folder; every warning is an error."""
    with TemporaryDirectory() as folder:
        spec, out = Path(folder) / "any.toml", Path(folder) / "out"
        spec.write_text(text, encoding="utf-8")
        with warnings.catch_warnings(), redirect_stdout(StringIO()), redirect_stderr(StringIO()) as said:
            warnings.simplefilter("error")
            code = main([command, str(spec), "-o", str(out)])
        files = {path.name: path for path in out.iterdir()} if out.exists() else {}
        design = loads(files["design.json"].read_text(encoding="utf-8")) if "design.json" in files else None
        return code, said.getvalue(), sorted(files), design


def judged(text):
    code, said, files, design = designed(text)
    if code == 0:
        assert (said, files) == ("", WHOLE)
        return design
    assert code in (1, 2)
    assert said.startswith("dob-companion: ")
    assert "any.toml: " in said
    assert said.count("\n") == 1
    assert files == []
    return None


@given(st.integers(0, 10**9))
@settings(max_examples=3, deadline=None, derandomize=True)
def test_any_spec_is_designed_or_refused_in_one_line(seed):
    judged(random_spec(seed))


@pytest.mark.proof
@given(st.integers(0, 10**9))
@settings(max_examples=300, deadline=None, print_blob=True)
def test_hundreds_of_specs_are_designed_and_verified_or_refused_in_one_line(seed):
    design = judged(random_spec(seed))
    if design is not None:
        assert all(finding.agrees for finding in verify(design))


@pytest.mark.parametrize("rate", [0.5, 1e6])
def test_slow_and_fast_rates_are_designed_and_drawn(rate):
    pitch = paper.spec_text().replace("rate_hz = 250.0", f"rate_hz = {rate}").partition("# Roll and yaw")[0]
    assert judged(pitch).dt == pytest.approx(1.0 / rate)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "delay_samples = 1 ",
            "delay_samples = 31 ",
            "design: delay_samples: expected a whole number of 0 or more, at most 30",
        ),
        ("delay_samples = 1 ", f"delay_samples = {10**4000} ", "design: delay_samples: expected a whole number"),
        ("rate_hz = 250.0", "rate_hz = 1e9", "design: rate_hz: expected a positive number of Hz, from 0.001 to 1e+06"),
        ("poles = [0.9962]", f"poles = {[0.5] * 50}", "order 54 together, expected at most 40"),
        ("gain = 0.14131 ", "gain = 1e300 ", "any.toml"),
    ],
)
def test_absurd_numbers_are_one_line(old, new, words):
    code, said, files, _ = designed(paper.spec_text().replace(old, new, 1))
    assert code in (1, 2)
    assert words in said
    assert len(said) < 400
    assert (said.count("\n"), files) == (1, [])
