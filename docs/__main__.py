"""Writes the pages of docs/ that are printed from the code: `python -m docs`, or `make docs`."""

from pathlib import Path

from dob_companion.supervisor.table import TABLE, State
from docs.vehicle import vehicle_page

HERE = Path(__file__).parent


def supervisor_page() -> str:
    """docs/supervisor.md, from the supervisor's table."""
    lines = [
        "# The supervisor",
        "",
        "Printed from the table in `dob_companion/supervisor/table.py` by `make docs`; the essay on it stands there.",
        "Exits are tried from top to bottom, the dangerous one first, one step a gyro sample. A correction may differ",
        "from zero in RAMP_IN, ACTIVE and RAMP_OUT only.",
        "",
        "```mermaid",
        "stateDiagram-v2",
        "    [*] --> DISABLED",
        *(f"    {state.name} --> {way.to.name}: {way.when}" for state, ways in TABLE.items() for way in ways),
        "```",
        "",
        "| state | number | exit | when |",
        "| --- | --- | --- | --- |",
        *(f"| {state.name} | {int(state)} | {way.to.name} | {way.when} |" for state in State for way in TABLE[state]),
        "",
    ]
    return "\n".join(lines)


PAGES = {"supervisor.md": supervisor_page, "vehicle.md": vehicle_page}


def main() -> None:
    """Write every page."""
    for name, page in PAGES.items():
        (HERE / name).write_text(page(), encoding="utf-8")
        print(f"docs/{name}")


if __name__ == "__main__":
    main()
