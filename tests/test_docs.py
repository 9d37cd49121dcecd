"""Pages that are printed from the code say what the code says."""

import contextlib
import re
import shlex
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

import dob_companion.cli.main
import sitl.campaign.cli
import sitl.cli
import sitl.sweep.cli
from dob_companion.companion import PARAMETERS
from docs.__main__ import HERE, PAGES
from docs.tuned import TABLES
from tests.comparison import test_docs as tuned
from tests.demo import test_demo as demo
from tests.sitl.sweep import test_sampling_zero as sampling_zero
from tests.sitl.sweep import test_wire as swept

LONG = {"vehicle.md": pytest.mark.proof}  # measures the vehicle by sweeps


@pytest.mark.parametrize("name", [pytest.param(name, marks=LONG.get(name, ())) for name in PAGES])
def test_a_printed_page_is_up_to_date(name):
    assert (HERE / name).read_text(encoding="utf-8") == PAGES[name](), "run `make docs`"


def test_the_contract_lists_every_parameter_with_its_default_and_range():
    text = Path(HERE / "interfaces.md").read_text(encoding="utf-8")
    for spec in PARAMETERS:
        (row,) = [line for line in text.splitlines() if line.startswith(f"| `{spec.name}`")]
        if not spec.read_only:
            _, _, _, default, values, _ = (cell.strip() for cell in row.split("|"))
            assert float(default) == spec.default
            low, high = values.replace("…", ",").split(",")
            assert (float(low), float(high)) == (spec.low, spec.high)


def test_a_quoted_measurement_names_a_bench_and_says_what_that_measures():
    """Its numbers are a computer's own: `python -m bench NAME --write` puts new ones in their place."""
    quoted = re.findall(
        r"^```\n\$ python -m bench (\w+)\n(\w+): (.*)\n(?:  .*\n)+```$",
        "".join(page.read_text(encoding="utf-8") for page in sorted(HERE.glob("*.md"))),
        flags=re.MULTILINE,
    )
    assert {name for name, _, _ in quoted} == {"coupled", "lockstep", "optimal", "saturation", "tune", "view"}
    for name, title, line in quoted:
        assert (title, line) == (name, import_module(f"bench.{name}").__doc__.partition("\n")[0])


PAGES_READ = (HERE.parent / "README.md", *sorted(HERE.glob("*.md")))
PARSERS = {
    "dob-companion": dob_companion.cli.main.parser,
    "python -m sitl": sitl.cli.parser,
    "python -m sitl.sweep": sitl.sweep.cli.parser,
    "python -m sitl.campaign": sitl.campaign.cli.parser,
    "python -m sitl.campaign replay": sitl.campaign.cli.replay_parser,
}


def test_every_test_that_a_page_names_exists():
    for page in PAGES_READ:
        file = None
        for named, test in re.findall(r"(tests/[\w/]+\.py)?(?:::(\w+))?", page.read_text(encoding="utf-8")):
            file = named or file
            if named:
                assert (HERE.parent / named).is_file(), f"{page.name}: {named}"
            if test and file:
                assert f"def {test}(" in (HERE.parent / file).read_text(encoding="utf-8"), (
                    f"{page.name}: {file}::{test}"
                )


def commands():
    """What pages show to be typed: lines of fenced and indented blocks, and inline code; not what is abridged."""
    for page in PAGES_READ:
        text = page.read_text(encoding="utf-8")
        shown = re.findall(r"^(?:```\w*\n.*?^```|    .*)$", text, flags=re.MULTILINE | re.DOTALL)
        lines = [line for block in shown for line in block.splitlines()] + re.findall(r"`([^`\n]+)`", text)
        for line in lines:
            typed = line.strip().removeprefix("$ ").partition(" #")[0].strip().removesuffix(" &")
            if typed.startswith(("dob-companion ", "python -m ")) and not re.search(r"[\[\]…|<;]", typed):
                yield page.name, typed


@pytest.mark.parametrize(("page", "typed"), sorted(set(commands())))
def test_every_command_that_a_page_shows_can_be_typed(page, typed, capsys):
    """Its program exists, and knows each option and verb; files and values are not looked at."""
    if typed.startswith("python -m ") and not typed.startswith("python -m sitl"):
        assert find_spec(typed.split()[2]) is not None
        return
    program = max((name for name in PARSERS if f"{typed} ".startswith(f"{name} ")), key=len, default=None)
    if program is None:
        assert find_spec(typed.split()[2]) is not None
        return
    words = ["1" if word in ("N", "S", "VALUE") else word for word in shlex.split(typed.removeprefix(program))]
    ended = None
    with contextlib.suppress(SystemExit):
        ended = PARSERS[program]().parse_args(words)
    said = capsys.readouterr().err
    # A page that speaks of a command as such leaves out what it requires
    assert ended is not None or not said or " required" in said or "expected one argument" in said, said


def test_what_the_readme_says_of_pitch_is_what_the_papers_page_measured():
    def peak(section, row):
        text = (HERE / "paper.md").read_text(encoding="utf-8").partition(f"## {section}:")[2].partition("\n## ")[0]
        return round(float(re.search(rf"^\| {re.escape(row)} \|[^|]*\| ([\d.]+) rad", text, flags=re.MULTILINE)[1]), 4)

    linear = "Figure 12, once more"
    readme = " ".join(PAGES_READ[0].read_text(encoding="utf-8").split())
    plain, tuned = (peak(linear, f"pitch, largest error, {weights} weights") for weights in ("the paper's", "tuned"))
    nonlinear = peak("Figure 12, tuned", "pitch, largest error")
    assert f"the table above has {plain}." in readme
    assert f"the same seed comes to {tuned} rad on these linear axes, and to {nonlinear} on the nonlinear" in readme


TUNED = [f"python -m docs.tuned ({name})" for tables in TABLES.values() for name in tables]
HELD = {
    "make demo DEMO_ARGS=--fast": demo.test_the_readme_shows_the_table_that_the_command_prints,
    "python -m sitl.sweep.sampling_zero": sampling_zero.test_the_documented_table_is_what_the_command_prints,
    "python -m sitl.sweep --airframe linear -o sweep": swept.test_the_documented_tables_are_what_the_command_prints,
    "python -m sitl.sweep -o sweep": swept.test_the_documented_tables_are_what_the_command_prints,
    "python -m sitl.sweep --flexible -o sweep": swept.test_the_documented_tables_are_what_the_command_prints,
    **dict.fromkeys(TUNED, tuned.test_the_documented_tables_are_what_the_command_prints),
}
"""Each table that a page marks as printed by a command, and the test that prints it again."""


def test_every_table_that_is_marked_as_printed_is_printed_again_by_a_test():
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES_READ)
    assert set(re.findall(r"<!-- table: (.*?) -->", text)) == set(HELD)
    assert all(map(callable, HELD.values()))
