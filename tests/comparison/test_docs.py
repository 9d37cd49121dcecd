"""The tables of docs/comparison.md and docs/tuning.md are what their commands find."""

import re
from pathlib import Path

import pytest

from dob_companion.comparison import compare
from docs.tuned import HERE, TABLES, designs, quoted

PAGE = Path(__file__).parents[2] / "docs" / "comparison.md"


@pytest.mark.proof
def test_the_documented_table_is_what_the_command_prints(designs):
    found = compare(designs[1], 20, "spec.toml")[0]
    lines = [line.replace("*", "").split("|") for line in PAGE.read_text(encoding="utf-8").splitlines()]
    table = {cells[1].strip(): [cell.strip() for cell in cells[2:]] for cells in lines if len(cells) > 10}
    for row in found.rows:
        cells = table[row.name]
        written = [float(re.split(" ", cells[i])[0]) for i in (0, 3)]
        assert written == pytest.approx([row.mean, row.disk_margin], rel=0.01), row.name
        assert cells[5] == str(row.order), row.name
        for cell, value in zip(cells[6:10], row.off_nominal.values(), strict=True):
            assert cell == "unstable" if value is None else float(cell) == pytest.approx(value, rel=0.01)


@pytest.mark.proof
def test_the_documented_tables_are_what_the_command_prints():
    found = designs()
    for page, tables in TABLES.items():
        text = (HERE / page).read_text(encoding="utf-8")
        for name, table in tables.items():
            assert quoted(text, name) == "\n".join(table(found)), f"{page}: run `python -m docs.tuned --write`"
