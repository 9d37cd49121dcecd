"""One bar: how far the attitude error is made smaller, beside the most that any observer could do."""

from dataclasses import dataclass

from dob_companion.analysis.attained import Attained, limit_words
from dob_companion.report.words import number

WIDTH = 760.0
"""Of the bar at its full length, in the units of its drawing."""


@dataclass(frozen=True, slots=True)
class Tick:
    """A line across the bar with a word below it."""

    x: float
    text: str
    anchor: str


@dataclass(frozen=True, slots=True)
class AttainedBar:
    """Lengths from the left end, where the observer is off; `limit` None where none is known."""

    key: str
    reached: float
    limit: float | None
    reached_text: str
    limit_text: str
    ticks: tuple[Tick, ...]
    head: str
    text: str
    alt: str


def attained_bar(key: str, found: Attained) -> AttainedBar:
    """Lengths are proportional to the attenuation less 1."""
    values = [found.reached, found.limit or 0.0, *(v for _, v in found.at_gains if v)]
    top = max(*values, 1.0 + 1e-9)

    def x(value: float) -> float:
        return round(WIDTH * max(value - 1.0, 0.0) / (top - 1.0), 1)

    reached = f"{number(found.reached, 3)} times"
    most = f"{number(found.limit, 3)} times" if found.limit else ""
    return AttainedBar(
        key=key,
        reached=x(found.reached),
        limit=x(found.limit) if found.limit else None,
        reached_text=f"this observer: {reached}",
        limit_text=f"any observer: at most {most}" if most else "",
        ticks=tuple(_tick(x(value) if value else 0.0, gain, value) for gain, value in found.at_gains),
        head=f"Attitude error {reached} smaller"
        + (f", at least {100.0 * found.share:.0f} % of what is possible." if found.share else "."),
        text=f"RMS with {found.weather}, observer off over on. {limit_words(found)} The marks say what is left of it "
        "where the plant answers 30 % less or more strongly than its model.",
        alt=f"A bar as long as the attenuation reached, {reached}"
        + (f", in a frame that ends {most}." if most else "."),
    )


def _tick(x: float, gain: float, value: float | None) -> Tick:
    change = f"{100.0 * (gain - 1.0):+.0f} %".replace("-", "−")
    anchor = "end" if x > WIDTH - 70.0 else "start" if x < 70.0 else "middle"
    return Tick(x, f"gain {change}: {number(value, 3) if value else 'unstable'}", anchor)
