"""`dob-companion param`: the companion's parameters from the ground."""

import argparse
import json
import math
from typing import Any

from dob_companion.errors import InputError

DEFAULT_LINK = "udpin:127.0.0.1:14550"


def add_parser(commands: Any) -> None:
    """Add `param` to the command line."""
    parser = commands.add_parser(
        "param",
        help="list, get and set the companion's parameters",
        description="The companion's parameters, read and written by a MAVSDK ground station through the vehicle.",
        epilog="example: dob-companion param set DOB_ENABLE 1",
    )
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="list|get|set")
    for verb, about in (("list", "all parameters"), ("get", "one parameter"), ("set", "write one parameter")):
        sub = verbs.add_parser(verb, help=about, epilog=_EXAMPLES[verb])
        if verb != "list":
            sub.add_argument("name", metavar="NAME")
        if verb == "set":
            sub.add_argument("value", type=float, metavar="VALUE")
        add_station_arguments(sub)
        sub.set_defaults(run=run)


_EXAMPLES = {
    "list": "example: dob-companion param list",
    "get": "example: dob-companion param get DOB_STATE",
    "set": "example: dob-companion param set DOB_ENABLE 1",
}


def add_station_arguments(parser: argparse.ArgumentParser) -> None:
    """The options that every operator's command shares."""
    parser.add_argument("--link", default=DEFAULT_LINK, metavar="URL", help="link to the vehicle (%(default)s)")
    parser.add_argument("--timeout", type=float, default=10.0, metavar="S", help="wait for a vehicle (%(default)s s)")
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Connect, do the verb, print what the companion says."""
    if args.verb == "set" and not math.isfinite(args.value):
        raise InputError(f"param set {args.name}: {args.value} is not a finite number")
    from dob_companion.ground import GroundStation
    from dob_companion.runtime.urls import parse_link_url

    url = parse_link_url(args.link)

    with GroundStation(url, args.timeout) as station:
        if args.verb == "list":
            values = station.parameters()
        else:
            if args.verb == "set":
                station.set_parameter(args.name, args.value)
            values = {args.name: station.parameter(args.name)}
    print(json.dumps(values) if args.json else "\n".join(f"{name:16} {value:g}" for name, value in values.items()))
    return 0
