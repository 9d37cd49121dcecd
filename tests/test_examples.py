"""Every Python example runs, writes its picture, and prints what docs/examples.md says it prints."""

import os
import re
import runpy
import subprocess
import sys
from contextlib import redirect_stdout
from functools import cache
from io import StringIO
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted(path for path in (ROOT / "examples").glob("*.py") if not path.name.startswith("_"))
NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")


@pytest.fixture
def page():
    return (ROOT / "docs" / "examples.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Runs an example once: its globals, what it printed, and where its picture is."""
    folder = tmp_path_factory.mktemp("examples") / "made" / "by the example"

    @cache
    def once(name):
        with pytest.MonkeyPatch.context() as patch, redirect_stdout(StringIO()) as out:
            patch.syspath_prepend(str(ROOT / "examples"))
            patch.setattr(sys, "argv", [name, str(folder)])
            names = runpy.run_path(str(ROOT / "examples" / f"{name}.py"), run_name="__main__")
        return names, out.getvalue(), folder / f"example_{name}.svg"

    return once


@pytest.mark.parametrize("name", [path.stem for path in EXAMPLES])
def test_an_example_prints_what_its_page_says_and_draws_its_picture(name, run, page):
    _, printed, picture = run(name)
    (shown,) = re.findall(rf"`examples/{name}.py`:\n\n```\n(.*?)```", page, re.DOTALL)
    assert NUMBER.sub("#", printed) == NUMBER.sub("#", shown)
    assert _numbers(printed) == pytest.approx(_numbers(shown), rel=0.02)
    assert ElementTree.parse(picture).getroot().tag.endswith("svg")
    assert f"(img/{picture.name})" in page
    assert (ROOT / "docs" / "img" / picture.name).is_file()


def test_the_page_shows_every_example_and_no_other(page):
    assert set(re.findall(r"^`examples/(\w+\.py)`:", page, re.MULTILINE)) == {path.name for path in EXAMPLES}


@pytest.mark.parametrize(
    ("place", "words"),
    [
        (["file"], "file is not a directory"),
        pytest.param(["a", "b"], "unrecognized arguments: b", marks=pytest.mark.proof),  # argparse's own
    ],
)
def test_a_place_that_is_none_is_told_before_the_work(place, words, tmp_path):
    (tmp_path / "file").write_text("")
    said = subprocess.run(
        [sys.executable, str(ROOT / "examples" / "paper.py"), *place],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        text=True,
        capture_output=True,
        check=False,
    )
    assert said.returncode != 0
    assert words in said.stderr
    assert "Traceback" not in said.stderr
    assert said.stdout == ""


def test_a_slow_zero_keeps_gamma_star_above_what_interpolation_allows(run):
    found, _, _ = run("slow_rhp_zero")
    assert (found["quiet"] >= found["limit"]).all()
    assert (found["usual"] >= found["quiet"]).all()
    assert found["quiet"][1] < 1.1 * found["limit"][1]


def _numbers(text):
    return [float(number) for number in NUMBER.findall(text)]
