"""Pages that are printed from the code say what the code says."""

import re
from importlib import import_module
from pathlib import Path

import pytest

from dob_companion.companion import PARAMETERS
from docs.__main__ import HERE, PAGES


@pytest.mark.parametrize("name", PAGES)
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


def test_every_measurement_that_a_page_quotes_is_what_its_command_prints_in_form():
    quoted = re.findall(
        r"^```\n\$ python -m bench (\w+)\n(\w+): (.*)\n(?:  .*\n)+```$",
        "".join(page.read_text(encoding="utf-8") for page in sorted(HERE.glob("*.md"))),
        flags=re.MULTILINE,
    )
    assert {name for name, _, _ in quoted} == {"lockstep", "saturation", "view"}
    for name, title, line in quoted:
        assert (title, line) == (name, import_module(f"bench.{name}").__doc__.partition("\n")[0])
