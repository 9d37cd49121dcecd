"""`dob-companion run`: the daemon."""

import argparse
import json
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from dob_companion.artifact import DobDesign, check_flyable, loads
from dob_companion.companion import Companion, CompanionConfig, Event, Status, parse_config
from dob_companion.companion.config import PROFILES
from dob_companion.files import read_text
from dob_companion.runtime import open_link, parse_link_url
from dob_companion.runtime import run as serve

DEFAULT_LINK = "udpin:127.0.0.1:14540"
RATE_HZ = 250.0
"""The rate at which profile `sitl` delivers samples; a design for another one is refused."""


def add_parser(commands: Any) -> None:
    """Add `run` to the command line."""
    parser = commands.add_parser(
        "run",
        help="the daemon: fly a design",
        description="Fly a certified design: read gyro rates and applied moments, answer each sample.",
        epilog=f"example: dob-companion run --design dob-demo/design.json --link {DEFAULT_LINK}",
    )
    parser.add_argument("--design", type=Path, required=True, metavar="FILE", help="design.json to fly")
    parser.add_argument("--link", default=DEFAULT_LINK, metavar="URL", help="link to the autopilot (%(default)s)")
    parser.add_argument("--profile", choices=PROFILES, default=PROFILES[0], help="where the inputs come from")
    parser.add_argument("--config", type=Path, metavar="FILE", help="TOML configuration")
    parser.add_argument("--timeout", type=float, metavar="S", help="give up without a vehicle after S seconds")
    parser.add_argument("--json", action="store_true", help="events and status as JSON lines on stdout")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Check the design, open the link, serve until told to stop."""
    design = load_flyable(args.design)
    config = parse_config(read_text(args.config), str(args.config)) if args.config else CompanionConfig()
    url = parse_link_url(args.link)
    link = open_link(url)
    companion = Companion(design, config, now=time.monotonic(), datagrams=url.datagrams)
    show = _as_json if args.json else _as_text
    show(Event.info(f"design {design.sha256[:8]}: {', '.join(block.name for block in design.blocks)}"))
    show(Event.info(f"listening on {url}; waiting for a vehicle" if args.timeout is None else f"listening on {url}"))
    try:
        code = serve(
            companion,
            link,
            timeout_s=args.timeout,
            on_event=show,
            on_status=_status_as_json if args.json else None,
        )
    finally:
        link.close()
    show(Event.info(_summary(companion.status())))
    return code


def load_flyable(path: Path) -> DobDesign:
    """Read a design and refuse it, with DesignFileError, unless it may be flown."""
    design = loads(read_text(path), str(path))
    check_flyable(design, RATE_HZ, str(path))
    return design


def _summary(status: Status) -> str:
    return (
        f"stopped: {status.stepped} samples stepped, {status.bridged} bridged, {status.gaps} gaps, "
        f"{status.late} late, {status.bad} malformed, {status.foreign} foreign"
    )


def _as_text(event: Event) -> None:
    print(f"{time.strftime('%H:%M:%S')} {event.severity.name.lower():8} {event.text}", file=sys.stderr, flush=True)


def _as_json(event: Event) -> None:
    print(json.dumps({"event": event.text, "severity": event.severity.name}), flush=True)


def _status_as_json(status: Status) -> None:
    print(json.dumps({"status": asdict(status) | {"state": status.state.name}}), flush=True)
