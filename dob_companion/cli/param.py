"""`dob-companion param`: the companion's parameters from the ground."""

import argparse
import json
import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from dob_companion.errors import InputError, NoVehicleError, RefusedError, unknown_key

if TYPE_CHECKING:
    from dob_companion.companion.parameters import ParameterSpec
    from dob_companion.ground import GroundStation
    from dob_companion.runtime.urls import LinkUrl

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


def station_url(link: str) -> "LinkUrl":
    """A ground station's link: port 14550 where it names none, and a telemetry radio's 57600 baud."""
    from dob_companion.runtime.urls import parse_link_url

    return parse_link_url(link, udp_port=14550, baud=57600)


def run(args: argparse.Namespace) -> int:
    """Connect, do the verb, print what the companion says."""
    if args.verb == "set" and not math.isfinite(args.value):
        raise InputError(f"param set {args.name}: {args.value} is not a finite number")
    url = station_url(args.link)
    from dob_companion.ground import GroundStation

    with GroundStation(url, args.timeout) as station:
        values = _with_hint(args.name, lambda: _asked(station, args)) if args.verb != "list" else station.parameters()
    print(json.dumps(values) if args.json else "\n".join(_lines(values)))
    return 0


def _asked(station: "GroundStation", args: argparse.Namespace) -> dict[str, float]:
    if args.verb == "set":
        station.set_parameter(args.name, args.value)
    return {args.name: station.parameter(args.name)}


def _with_hint(name: str, ask: Callable[[], dict[str, float]]) -> dict[str, float]:
    """What the table knows of a refused parameter goes into its refusal."""
    from dob_companion.companion import PARAMETERS

    try:
        return ask()
    except NoVehicleError:
        raise
    except RefusedError as refused:
        spec = next((spec for spec in PARAMETERS if spec.name == name), None)
        if spec is None:
            _, _, near = unknown_key(name, (spec.name for spec in PARAMETERS)).partition("; ")
            raise RefusedError(f"{refused}; {near}") from None
        if spec.read_only:
            raise
        raise RefusedError(f"{refused}; {name} is {in_range(spec)}") from None


def _lines(values: dict[str, float]) -> Iterator[str]:
    """Name, value with its unit or word, range, meaning; what this version does not know comes last."""
    from dob_companion.companion import PARAMETERS
    from dob_companion.companion.parameters import in_words

    order = {spec.name: spec for spec in PARAMETERS if spec.name in values}
    for name in [*order, *(name for name in values if name not in order)]:
        shown = f"{values[name]:<4g} {in_words(name, values[name])}"
        about = f"{in_range(order[name]):11}{order[name].meaning}" if name in order else ""
        yield f"{name:12}{shown:24}{about}".rstrip()


def in_range(spec: "ParameterSpec") -> str:
    """What may be written to a parameter."""
    if spec.read_only:
        return "read-only"
    return (
        f"{spec.low:g} or {spec.high:g}" if spec.whole and spec.high - spec.low == 1 else f"{spec.low:g}…{spec.high:g}"
    )
