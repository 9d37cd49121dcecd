"""`dob-companion run`: the daemon."""

import argparse
from pathlib import Path
from typing import Any

DEFAULT_LINK = "udpin:127.0.0.1:14540"
DEFAULT_PORT = 8191
"""Of the status page: the companion's component id, above 8000 as pages are."""

PROFILES = ("auto", "sitl", "ardupilot", "px4")
"""The names of `mavlink.profiles`, which would take too long to import for a `--help`; a test compares them."""


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
    add_profile(parser)
    parser.add_argument("--config", type=Path, metavar="FILE", help="TOML configuration")
    parser.add_argument("--state", type=Path, metavar="DIR", help="keep parameters written by the operator here")
    parser.add_argument("--record", metavar="DIR", help="record the flight here, trace and .tlog")
    parser.add_argument("--record-mb", type=float, metavar="MB", help="size of a segment (64)")
    parser.add_argument("--record-segments", type=int, metavar="N", help="segments kept (16)")
    parser.add_argument(
        "--status-page",
        type=_port,
        nargs="?",
        const=DEFAULT_PORT,
        metavar="PORT",
        help=f"serve a status page on 127.0.0.1 ({DEFAULT_PORT})",
    )
    parser.add_argument("--timeout", type=float, metavar="S", help="give up without a vehicle after S seconds")
    parser.add_argument("--json", action="store_true", help="events and status as JSON lines on stdout")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Serve until told to stop."""
    from dob_companion.cli.daemon import fly

    record = {"dir": args.record, "mb": args.record_mb, "segments": args.record_segments}
    return fly(
        args.design,
        args.link,
        profile=args.profile,
        config=args.config,
        state=args.state,
        record={key: value for key, value in record.items() if value is not None},
        timeout_s=args.timeout,
        page_port=args.status_page,
        as_json=args.json,
    )


def add_profile(parser: Any) -> None:
    """Add `--profile`."""
    parser.add_argument(
        "--profile", choices=PROFILES, help="what is known of the vehicle (auto: by the make of its autopilot)"
    )


def _port(text: str) -> int:
    port = int(text) if text.isascii() and text.isdigit() else -1
    if not 0 <= port <= 65535:
        raise argparse.ArgumentTypeError(f"port is {text!r}, expected 1 to 65535, or 0 for any that is free")
    return port
