"""What both pages share: the template engine, the figure as a template sees it, and the page put together.

Everything that comes from a file is escaped by jinja2; only SVG, JSON and the page's own style and script are not.
"""

import re
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from dob_companion.report import draw
from dob_companion.report.chart import Chart

_TEMPLATES = Environment(
    loader=PackageLoader("dob_companion.report"),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
)


def _signals(text: str) -> Markup:
    """Escaped text with its signal names set: `W_d` lowered, `z^−1` raised, `d_hat` as d with a hat."""
    safe = str(escape(text)).replace("d_hat", "d̂")
    safe = re.sub(r"\b([A-Za-z])_([a-z])\b", r"<i>\1</i><sub>\2</sub>", safe)
    return Markup(re.sub(r"\bz\^(−?\w+)", r"z<sup>\1</sup>", safe))


_TEMPLATES.filters["signals"] = _signals
_WIDE = 800


@dataclass(frozen=True, slots=True, kw_only=True)
class PageFigure:
    """A chart with its words, ready for the `figure` macro."""

    key: str
    title: str
    caption: str
    alt: str
    svg: Markup
    data: Markup
    wide: bool


def figure(chart: Chart, title: str, caption: str) -> PageFigure:
    """Draw `chart`; `title` and `caption` are plain text."""
    return PageFigure(
        key=chart.key,
        title=title,
        caption=caption,
        alt=chart.alt,
        svg=Markup(draw.svg(chart)),  # matplotlib escapes text
        data=Markup(draw.data(chart)),  # holds no "<"
        wide=chart.width > _WIDE,
    )


def render(template: str, **values: Any) -> str:
    """The page as one HTML text, style and script inside it."""
    return _TEMPLATES.get_template(template).render(css=_static("style.css"), js=_static("page.js"), **values)


def _static(name: str) -> Markup:
    return Markup((files("dob_companion.report") / "static" / name).read_text(encoding="utf-8"))
