"""Parts of a spec's text: models, numbers and comments as a person would write them."""

from collections.abc import Iterable, Iterator

from dob_companion.autopilots.transfer import Transfer

WIDTH = 120


def model_lines(model: Transfer, method: str, delay_s: float = 0.0) -> list[str]:
    """The keys of a continuous model."""
    lines = [f"num = {listed(model.num)}", f"den = {listed(model.den)}", 'domain = "s"', f'method = "{method}"']
    return [*lines, f"delay_s = {number(delay_s)}"] if delay_s else lines


def listed(numbers: Iterable[float]) -> str:
    """A TOML array."""
    return "[" + ", ".join(map(number, numbers)) + "]"


def number(value: float) -> str:
    """A TOML float of twelve digits."""
    return repr(float(f"{value:.12g}"))


def comment(text: str) -> Iterator[str]:
    """Comment lines; long ones go on in the next, indented."""
    line = "#"
    for word in text.split(" "):
        if len(line) + 1 + len(word) > WIDTH:
            yield line
            line = "#  "
        line += f" {word}"
    yield line
