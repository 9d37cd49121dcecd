"""The page of a campaign: distributions and the worst flights, one HTML file that needs nothing else."""

import shlex
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from dob_companion import __version__
from sitl.campaign import charts
from sitl.campaign.directory import Directory
from sitl.campaign.pilot import Row
from sitl.campaign.plan import Between, Values
from sitl.campaign.store import replace
from sitl.campaign.summary import summarize, varied
from sitl.constants import AXES

_TEMPLATES = Environment(
    loader=PackageLoader("sitl.campaign"),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)


def write_page(directory: Directory, rows: list[Row]) -> None:
    """Write `index.html` into the campaign's directory."""
    replace(directory.path / "index.html", render(directory, rows).encode())


def render(directory: Directory, rows: list[Row]) -> str:
    """The page as one text."""
    campaign, summary = directory.campaign, summarize(directory, rows)
    names = varied(campaign)
    whole = [row for row in rows if row["outcome"] == "complete"]
    groups = charts.grouped(whole, names)
    figures = [charts.distribution(groups, "rms_ratio", "RMS of the attitude error, off / on", "share of flights")]
    figures.append(
        charts.distribution(groups, "peak_on", "peak attitude error with the observer on, rad", "share of flights")
    )
    figures += [
        charts.scatter(groups, name, title)
        for name, title in (
            ("gain", "plant gain / designed"),
            ("pole", "lag corner / designed"),
            ("wind_m_s", "mean wind, m/s"),
        )
        if isinstance(getattr(campaign, name), Between)
    ]
    return _TEMPLATES.get_template("page.html.j2").render(
        title=f"{summary['flown']} flights: {directory.scenario.title}",
        generator=f"dob-companion {__version__}",
        axes=AXES,
        lead=_lead(summary),
        facts=_facts(directory),
        names=names,
        groups=summary["groups"],
        figures=[Markup(svg) for svg in figures if svg] if whole else [],
        worst=[
            {**row, "command": _command(directory, row["flight"]), "story": _story(row)} for row in summary["worst"]
        ],
    )


def _story(row: Row) -> str:
    """What happened, in words."""
    if row["outcome"] != "complete":
        return str(row["reason"])
    words = [f"{row['state']}: {row['reason']}" if row["reason"] else row["state"]]
    if row["missed"]:
        words.append(f"missed {row['missed']}")
    return "; ".join(words)


def _lead(summary: dict[str, Any]) -> str:
    failed, missed = summary["failed"], summary["missed"]
    if summary["flown"] == failed:
        return "No flight reached its end."
    groups = [group for group in summary["groups"] if "axes" in group]
    found = [ratio["min"] for g in groups for axis in AXES if (ratio := g["axes"][axis]["rms_ratio"])]
    words = f"{failed or 'No'} flights did not reach their end; {missed or 'none'} missed a check of the scenario."
    if not found:
        return words
    low = min(found)
    if low < 1.0:
        return f"On some axis of some flight the error grows with the observer: RMS off/on falls to {low:.2f}. {words}"
    return (
        f"The observer takes the RMS attitude error down {low:.2f} times or more on each axis of each flight. {words}"
    )


def _facts(directory: Directory) -> list[tuple[str, str]]:
    campaign = directory.campaign
    last = campaign.first_seed + campaign.seeds - 1
    facts = [
        ("scenario", directory.scenario.name),
        ("seeds", f"{campaign.first_seed} to {last}"),
        ("airframes", ", ".join(campaign.airframes)),
        ("designs", ", ".join(campaign.designs)),
        ("delays", ", ".join(map(str, campaign.delays)) + " samples"),
        ("plant gain", _words(campaign.gain)),
        ("lag corner", _words(campaign.pole)),
    ]
    if campaign.wind_m_s:
        facts.append(("mean wind", _range(campaign.wind_m_s) + " m/s, with its turbulence"))
    if campaign.parameters:
        facts.append(("parameters", ", ".join(f"{name} = {value:g}" for name, value in campaign.parameters.items())))
    return facts


def _words(values: Values) -> str:
    return "as designed" if values == (1.0,) else _range(values) + " of the designed"


def _range(values: Values) -> str:
    if isinstance(values, Between):
        return f"{values.low:g} to {values.high:g}, drawn for each seed,"
    return ", ".join(f"{value:g}" for value in values)


def _command(directory: Directory, number: int) -> str:
    return f"python -m sitl.campaign replay {shlex.quote(str(directory.path))} --flight {number} -o flight-{number}"
