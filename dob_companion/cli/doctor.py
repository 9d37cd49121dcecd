"""`dob-companion doctor`: what is heard on a link, and whether a design can fly on it."""

import argparse
import json
import math
import sys
import textwrap
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dob_companion.cli.run import DEFAULT_LINK, add_profile

if TYPE_CHECKING:
    from dob_companion.companion import Event
    from dob_companion.doctor.diagnosis import Diagnosis
    from dob_companion.doctor.listening import Listening

MARKS = {"ok": "ok     ", "note": "note   ", "missing": "MISSING"}


def add_parser(commands: Any) -> None:
    """Add `doctor` to the command line."""
    parser = commands.add_parser(
        "doctor",
        help="what is heard on a link, and what is missing",
        description="Listen to a vehicle: who is heard, rates, delays, signs, which profile fits, what is missing. "
        "Sends heartbeats, TIMESYNC and requests for streams, parameters and version; writes and corrects nothing. "
        "Exit code 0: fit to fly by; 1: not.",
        epilog=f"example: dob-companion doctor --link {DEFAULT_LINK} --design design.json",
    )
    parser.add_argument("--link", default=DEFAULT_LINK, metavar="URL", help="link to the autopilot (%(default)s)")
    parser.add_argument("--design", type=Path, metavar="FILE", help="judge for this design; adds the sign check")
    add_profile(parser)
    parser.add_argument("--config", type=Path, metavar="FILE", help="that of `run`: its axes, and its key to sign with")
    parser.add_argument("--state", type=Path, metavar="DIR", help="that of `run`: where signing timestamps are kept")
    parser.add_argument("--seconds", type=_seconds, default=5.0, metavar="S", help="time to measure (%(default)g)")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(run=run)


def _seconds(text: str) -> float:
    value = float(text)
    if not 0.5 <= value <= 3600.0:
        raise argparse.ArgumentTypeError("expected 0.5 to 3600 seconds")
    return value


def run(args: argparse.Namespace) -> int:
    """Listen, judge, print."""
    import time
    from contextlib import ExitStack

    from dob_companion.cli.daemon import configured, load_flyable
    from dob_companion.cli.signing import open_signing
    from dob_companion.doctor.diagnosis import diagnose
    from dob_companion.doctor.listening import Listening, Stage
    from dob_companion.doctor.settings import wanted
    from dob_companion.mavlink import profiles
    from dob_companion.runtime import open_link, parse_link_url
    from dob_companion.runtime.listen import listen
    from dob_companion.runtime.signed import SigningLink

    settings, _ = configured(args.config, args.state, args.profile)
    design = load_flyable(args.design, settings.profile) if args.design else None
    url = parse_link_url(args.link)
    dt = design.dt if design else 1.0 / profiles.rate_hz(settings.profile)

    def tell(stage: Stage) -> None:
        if sys.stderr.isatty() and stage is not Stage.DONE:
            print(f"{url}: {stage.value} …", file=sys.stderr, flush=True)

    def complain(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    def say(event: "Event") -> None:
        complain(event.text)

    with ExitStack() as leaving:
        link = open_link(url)
        leaving.callback(link.close)
        gate = None
        signing = open_signing(settings, say, complain, leaving, datagrams=url.datagrams)
        if signing is not None:
            gate = signing.gate
            link = SigningLink(link, gate)
        now = time.monotonic()
        listening = Listening(
            dt,
            args.seconds,
            design,
            now=now,
            datagrams=url.datagrams,
            gate=gate,
            profile=settings.profile,
            wanted=wanted,
            axes=settings.axes,
        )
        listen(listening, link, tell, say)
    diagnosis = diagnose(listening, design)
    if args.json:
        print(json.dumps(_as_json(listening, diagnosis), indent=1))
    else:
        print("\n".join(_as_text(listening, diagnosis)))
    return 0 if diagnosis.fit else 1


def _as_text(listening: "Listening", diagnosis: "Diagnosis") -> Iterator[str]:
    for finding in diagnosis.findings:
        yield from _wrapped(f"{MARKS[finding.verdict.value]}  {finding.topic:14}  ", finding.text, 25)
        if finding.remedy:
            yield from _wrapped(f"{'':25}→ ", finding.remedy, 27)
    rows = [row for row in _streams(listening) if row["count"] > 1]
    if rows:
        yield ""
        yield f"{'':38}{'rate, Hz, by':>19}"
        yield f"{'from':7} {'message':24}{'count':>6}{'stamp':>10}{'clock':>9}   intervals"
    for row in sorted(rows, key=lambda row: -row["count"]):
        stamp = f"{row['rate_by_stamp_hz']:.1f}" if row["rate_by_stamp_hz"] is not None else "—"
        who, name = f"{row['system']}/{row['component']}", _cut(row["message"], 23)
        numbers = f"{who:7} {name:24}{row['count']:>6}{stamp:>10}{row['rate_by_clock_hz']:>9.1f}   "
        yield from _wrapped(numbers, row["stamps"], len(numbers))
    yield ""
    yield "fit to fly by" if diagnosis.fit else "not fit to fly by: see what is MISSING"


def _wrapped(first: str, text: str, indent: int) -> list[str]:
    """Lines of 80 columns at most, where words allow."""
    return textwrap.wrap(
        text, 80, initial_indent=first, subsequent_indent=" " * indent, break_long_words=False, break_on_hyphens=False
    )


def _cut(name: str, most: int) -> str:
    return name if len(name) <= most else f"{name[: most - 1]}…"


def _as_json(listening: "Listening", diagnosis: "Diagnosis") -> dict[str, Any]:
    trips = sorted(listening.round_trips_s)
    return {
        "fit": diagnosis.fit,
        "profile": diagnosis.profile,
        "findings": [asdict(finding) | {"verdict": finding.verdict.value} for finding in diagnosis.findings],
        "heard": [
            {
                "system": p.sender.system,
                "component": p.sender.component,
                "autopilot": p.make,
                "vehicle": p.vehicle,
                "armed": p.armed,
                "signatures": {str(kind): count for kind, count in listening.signatures[p.sender].items()},
            }
            for p in listening.presences.values()
        ],
        "version": listening.version,
        "parameters": listening.parameters,
        "streams": list(_streams(listening)),
        "round_trip_ms": {
            "asked": listening.asked_time,
            "answered": len(trips),
            "median": 1e3 * trips[len(trips) // 2] if trips else None,
            "p95": 1e3 * trips[math.ceil(0.95 * len(trips)) - 1] if trips else None,
        },
    }


def _streams(listening: "Listening") -> Iterator[dict[str, Any]]:
    for (sender, name), stream in listening.streams.items():
        by_stamp = stream.rate_by_stamp_hz
        drift, error = stream.drift_percent()
        known = stream.stamped and not math.isnan(drift)
        yield {
            "system": sender.system,
            "component": sender.component,
            "message": name,
            "count": len(stream.wall),
            "rate_by_stamp_hz": None if math.isnan(by_stamp) else by_stamp,
            "rate_by_clock_hz": stream.rate_by_wall_hz,
            "stamps": (stream.pattern() + ("" if stream.fine else ", counted in ms")) if stream.stamped else "none",
            "gaps": stream.gaps if stream.stamped else None,
            "drift_percent": drift if known else None,
            "drift_error_percent": error if known else None,
        }
