"""What a figure of the paper comes to: numbers beside ours, each with the tolerance that decides whether they agree."""

from dataclasses import dataclass, field

from dob_companion.report.chart import Chart

ROUNDING = 1e-9
"""A difference below it is what the last digits of the arithmetic leave; other machines give other digits."""


@dataclass(frozen=True, slots=True)
class Number:
    """One number of the paper's text beside ours.

    It agrees when ours lies from `low` to `high`; None leaves that side open.
    """

    what: str
    paper: str
    ours: float
    unit: str
    low: float | None = None
    high: float | None = None

    @property
    def agrees(self) -> bool:
        """Whether ours lies within the bounds."""
        return (self.low is None or self.ours >= self.low) and (self.high is None or self.ours <= self.high)

    @property
    def shown(self) -> str:
        """Ours with its unit."""
        value = f"< {ROUNDING:.0e}" if 0.0 < abs(self.ours) < ROUNDING else f"{self.ours:.4g}"
        return f"{value} {self.unit}"

    @property
    def accepted(self) -> str:
        """The bounds in words."""
        if self.low is None and self.high is None:
            return "–"
        if self.low is not None and self.high is not None:
            return f"{self.low:.4g} … {self.high:.4g}"
        return f"≥ {self.low:.3g}" if self.low is not None else f"≤ {self.high:.3g}"


@dataclass(frozen=True, slots=True)
class Section:
    """One figure or a pair of them."""

    figures: str
    title: str
    paper_says: str
    ours_is: str
    numbers: tuple[Number, ...]
    charts: tuple[Chart, ...] = ()
    differences: tuple[str, ...] = field(default=())

    def markdown(self) -> str:
        """The section as it stands in docs/paper.md."""
        lines = [f"## {self.figures}: {self.title}", "", f"**The paper.** {self.paper_says}", ""]
        lines += [f"**Here.** {self.ours_is}", ""]
        for chart in self.charts:
            lines += [f"![{chart.alt}](img/paper_{chart.key}.svg)", ""]
        lines += ["| | paper | here | accepted | agrees |", "| --- | --- | --- | --- | --- |"]
        lines += [
            f"| {n.what} | {n.paper} | {n.shown} | {n.accepted} | {'yes' if n.agrees else '**no**'} |"
            for n in self.numbers
        ]
        if self.differences:
            lines += ["", *(f"- {text}" for text in self.differences)]
        return "\n".join([*lines, ""])
