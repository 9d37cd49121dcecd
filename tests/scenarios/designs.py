"""Observers for the scenarios' airframes, one for each link delay, from the specs among the examples."""

from functools import cache
from pathlib import Path

from dob_companion.artifact import DobDesign, dumps
from dob_companion.synthesis import design_from_toml

EXAMPLES = Path(__file__).parents[2] / "examples"
SPECS = {"linear": "tailsitter_paper.toml", "tailsitter": "tailsitter_nonlinear.toml"}


@cache
def design_for(airframe: str, delay: int) -> DobDesign:
    """The observer for this airframe, designed for this link delay in samples."""
    text = (EXAMPLES / SPECS[airframe]).read_text(encoding="utf-8")
    assert "delay_samples = 1 " in text
    return design_from_toml(text.replace("delay_samples = 1 ", f"delay_samples = {delay} ", 1))


def design_files(directory: Path, delays: tuple[int, ...]) -> dict[tuple[str, int], Path]:
    """design.json of every airframe and delay, written into a directory."""
    files = {}
    for airframe in SPECS:
        for delay in delays:
            files[airframe, delay] = directory / f"design-{airframe}-{delay}.json"
            files[airframe, delay].write_text(dumps(design_for(airframe, delay))[0], "utf-8")
    return files
