"""`dob-companion excite`: move a hovering aircraft on its moments, within limits, and record how it answers."""

import argparse
import math
from pathlib import Path
from typing import Any

from dob_companion.artifact import AXES
from dob_companion.cli.run import DEFAULT_LINK, add_profile
from dob_companion.cli.spec import by_axis, merged

SIGNALS = ("multisine", "chirp")
"""`excitation.signal.KINDS`, which would take too long to import for a `--help`."""

EXCITED_S = 30.0
"""Of an axis, unless told otherwise."""


def add_parser(commands: Any) -> None:
    """Add `excite` to the command line."""
    parser = commands.add_parser(
        "excite",
        help="move a hovering aircraft within limits, and record it",
        description="Wait until the aircraft hovers, add a small moment to one axis after another, record what the "
        "link shows. Whatever is not well ends it: limits, mode or kill switch, a lost sample, another companion. "
        "DOB_ENABLE 0, written by a ground station, and Ctrl-C end it as well. Exit code 0: complete; 1: aborted.",
        epilog=f"example: dob-companion excite --link {DEFAULT_LINK} --axis pitch -o excited",
    )
    add = parser.add_argument
    add("--link", default=DEFAULT_LINK, metavar="URL", help="link to the autopilot (%(default)s)")
    add("--axis", action="append", choices=AXES, help="again for another one (roll, pitch and yaw)")
    add("-o", "--out", type=Path, required=True, metavar="DIR", help="excite.json and excite.tlog go here")
    add_excitation(parser)
    add("--json", action="store_true", help="print excite.json")
    parser.set_defaults(run=run)


def add_excitation(parser: Any, *, seconds: float = EXCITED_S) -> None:
    """How strongly, how long and within which limits an aircraft is moved; `seconds` an axis unless told otherwise."""
    add = parser.add_argument
    add("--signal", choices=SIGNALS, default="multisine", help="(%(default)s)")
    add("--seconds", type=float, default=seconds, metavar="S", help="for each axis (%(default)g)")
    add("--band", type=float, nargs=2, default=(0.3, 100.0), metavar=("LOW", "HIGH"), help="Hz (0.3 100)")
    add("--seed", type=int, default=1, metavar="N", help="of the phases (%(default)s)")
    peak = "peak of the moment, normalized torque, 0 to 0.5 (roll=0.06,pitch=0.06,yaw=0.12)"
    add("--amplitude", type=by_axis, action="append", default=[], metavar="AXIS=N", help=peak)
    rate = "largest body rate; an axis that would come near it gets a smaller amplitude (%(default)g)"
    add("--largest-rate", type=_within(0.1, 10.0), default=1.5, metavar="RAD_S", help=rate)
    tilt = "largest angle to the vertical (%(default)g)"
    add("--largest-tilt", type=_within(2.0, 60.0), default=25.0, metavar="DEG", help=tilt)
    climb = "largest change of altitude (%(default)g)"
    add("--largest-climb", type=_within(0.2, 100.0), default=2.0, metavar="M", help=climb)
    battery = "least charge of the battery (%(default)g)"
    add("--least-battery", type=_within(0.0, 100.0), default=20.0, metavar="PERCENT", help=battery)
    add_profile(parser)
    add("--config", type=Path, metavar="FILE", help="that of `run`: system, profile, regime with its kill switch, key")
    add("--state", type=Path, metavar="DIR", help="that of `run`: where signing timestamps are kept")
    add("--timeout", type=_within(0.1, 86400.0), metavar="S", help="give up if it has not begun after S seconds")


def run(args: argparse.Namespace) -> int:
    """Excite, record, print."""
    return excite(args, args.out, as_json=args.json)


def excite(args: argparse.Namespace, out: Path, *, as_json: bool) -> int:
    """As the options of `add_excitation`, and `link` and `axis`, say. Returns the exit code; results go to `out`."""
    from dob_companion.cli.exciting import Exciting
    from dob_companion.excitation.limits import Limits
    from dob_companion.excitation.plan import AMPLITUDES
    from dob_companion.excitation.signal import Excitation

    asked = merged("--amplitude", args.amplitude, lambda x: 0.0 < x <= 0.5, "a number above 0, 0.5 at most")
    low_hz, high_hz = args.band
    return Exciting(
        link=args.link,
        out=out,
        signal=Excitation(kind=args.signal, low_hz=low_hz, high_hz=high_hz, seconds=args.seconds, seed=args.seed),
        amplitudes={
            axis: asked.get(axis, asked.get("", AMPLITUDES[axis])) for axis in dict.fromkeys(args.axis or AXES)
        },
        limits=Limits(
            rate=args.largest_rate,
            tilt=math.radians(args.largest_tilt),
            altitude_change=args.largest_climb,
            battery=1e-2 * args.least_battery,
        ),
        config=args.config,
        state=args.state,
        profile=args.profile,
        timeout_s=args.timeout,
        as_json=as_json,
    ).run()


def _within(low: float, high: float) -> Any:
    def number(text: str) -> float:
        value = float(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text!r}, expected a number from {low:g} to {high:g}")
        return value

    return number
