"""The result as tables for the terminal."""

from collections.abc import Mapping
from typing import Any


def result_table(result: Mapping[str, Any], designed_delay: int) -> str:
    """Axis; peak and RMS attitude error off and on; ratios, beside the paper's if it has any; what the link did."""
    paper = any(a["paper_ratio"] is not None for a in result["axes"].values())
    head = (
        f"{'':7}{'peak attitude error, rad':^{30 if paper else 23}}{'RMS attitude error, rad':^28}\n"
        f"{'axis':7}{'off':>8}{'on':>9}{'off/on':>8}{'paper' if paper else '':>{7 if paper else 0}}"
        f"{'off':>10}{'on':>9}{'off/on':>8}"
    )
    rows = [
        f"{name:7}{a['peak_off']:>8.4f}{a['peak_on']:>9.4f}{_ratio(a['peak_ratio'], '.1f'):>8}"
        f"{_ratio(a['paper_ratio'], 'g') if paper else '':>{7 if paper else 0}}"
        f"{a['rms_off']:>10.5f}{a['rms_on']:>9.5f}{_ratio(a['rms_ratio'], '.1f'):>8}"
        for name, a in result["axes"].items()
    ]
    measured = "–" if result["delay_samples"] is None else result["delay_samples"]
    link = (
        f"link delay in samples: {measured} measured, {designed_delay} designed for;  {result['rate_hz']:.2f} Hz\n"
        f"{result['samples_lost']} of {result['samples']} samples lost;  seed {result['seed']}, {result['clock']} clock"
    )
    return "\n".join((head, *rows, link))


def checks_table(result: Mapping[str, Any]) -> str:
    """What the scenario demands, and whether the flight met it."""
    rows = [("check", "value", "at least", "at most", "")] + [
        (
            c["check"],
            *(_ratio(c[key], ".4g") for key in ("value", "at_least", "at_most")),
            "ok" if c["passed"] else "FAILED",
        )
        for c in result["checks"]
    ]
    widths = [max(len(row[i]) for row in rows) for i in range(4)]
    return "\n".join(
        f"{name:{widths[0]}}  {value:>{widths[1]}}  {low:>{widths[2]}}  {high:>{widths[3]}}  {word}".rstrip()
        for name, value, low, high, word in rows
    )


def missed_checks(result: Mapping[str, Any]) -> list[str]:
    """The checks that the flight did not meet, by name."""
    return [check["check"] for check in result["checks"] if not check["passed"]]


def _ratio(value: float | None, form: str) -> str:
    return "–" if value is None else f"{value:{form}}"
