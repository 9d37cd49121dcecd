"""What the pages of docs/ quote."""

from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"


def table(page, command):
    """The lines of the table that a page marks as printed by a command."""
    text = (DOCS / page).read_text(encoding="utf-8")
    _, found, rest = text.partition(f"<!-- table: {command} -->\n")
    assert found, f"{page} has no table of {command}"
    lines = rest.partition("<!-- end of table -->")[0].splitlines()
    return [line for line in lines if line and not line.startswith("```")]
