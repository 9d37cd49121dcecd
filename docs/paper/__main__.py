"""`python -m docs.paper [-o DIR]`: design, sweep, fly and write docs/paper.md with its figures."""

import argparse
import tempfile
from pathlib import Path

from dob_companion.demo import Demo, fly
from dob_companion.demo.screen import PlainScreen
from dob_companion.report.draw import standalone
from dob_companion.synthesis import design_from_toml
from docs.paper import frequency, hover, rod, sweep
from docs.paper.page import page
from docs.paper.section import Section

ROOT = Path(__file__).parents[2]
SPEC = ROOT / "examples" / "tailsitter_paper.toml"
TUNED = SPEC.with_name("tailsitter_tuned.toml")
FLIGHTS = {
    "nonlinear": (SPEC, "paper_nonlinear"),
    "nonlinear_tuned": (TUNED, "paper_nonlinear"),
    "linear": (SPEC, "paper"),
    "linear_tuned": (TUNED, "paper"),
    "rod": (SPEC, "rod"),
}


def no_delay() -> str:
    """The paper's own case: the observer inside the controller."""
    return SPEC.read_text("utf-8").replace("delay_samples = 1", "delay_samples = 0", 1)


def make(work: Path) -> list[Section]:
    """Every section, from the paper's numbers alone; flights and sweeps leave their files in `work`."""
    for name, (spec, scenario) in FLIGHTS.items():
        fly(Demo(spec=spec, out=work / name, seed=1, fast=True, scenario=scenario), PlainScreen())
    without_link = design_from_toml(no_delay(), str(SPEC))
    return [
        sweep.section(work / "sweep"),
        *frequency.sections(without_link),
        *hover.sections(work, without_link),
        *rod.sections(work / "rod"),
    ]


def main() -> None:
    """Make and write."""
    parser = argparse.ArgumentParser(prog="python -m docs.paper", description=__doc__)
    parser.add_argument("-o", dest="out", type=Path, default=ROOT / "docs", help="where paper.md and img/ go")
    out: Path = parser.parse_args().out
    with tempfile.TemporaryDirectory() as work:
        sections = make(Path(work))
    (out / "img").mkdir(parents=True, exist_ok=True)
    for chart in (chart for section in sections for chart in section.charts):
        (out / "img" / f"paper_{chart.key}.svg").write_text(standalone(chart), encoding="utf-8")
    (out / "paper.md").write_text(page(sections), encoding="utf-8")


if __name__ == "__main__":
    main()
