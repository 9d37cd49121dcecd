"""`dob-companion check`: a few seconds of small excitation say whether a design's model still holds."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dob_companion.cli.identification_options import add_source

if TYPE_CHECKING:
    from dob_companion.artifact import DobDesign

SECONDS = 8.0
EXIT_NOT_HELD = 1


def add_parser(commands: Any) -> None:
    """Add `check` to the command line."""
    parser = commands.add_parser(
        "check",
        help="whether a design's model still holds",
        description="Excite the hovering aircraft for some seconds on each axis of a design, or take a log, and "
        "compare what is seen with the design's model: gain and delay, each with its 95 % interval. Before a flight, "
        "and after a change of payload, propellers or parameters. Exit code 0: it holds; 1: it does not, or cannot be "
        "told.",
        epilog="example: dob-companion check --link udpin:127.0.0.1:14540 --design my-aircraft/design.json",
    )
    add_source(parser, seconds=SECONDS)
    parser.add_argument("--design", type=Path, required=True, metavar="FILE", help="design.json")
    parser.add_argument("-o", "--out", type=Path, metavar="DIR", help="keep what was recorded here")
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Excite, compare, say."""
    from contextlib import ExitStack
    from tempfile import TemporaryDirectory

    from dob_companion.artifact import loads
    from dob_companion.cli.identifying import logs_of
    from dob_companion.files import read_text

    design = loads(read_text(args.design), str(args.design))
    args.axis = [axis for block in design.blocks for axis in block.axes]
    with ExitStack() as leaving:
        folder = args.out or Path(leaving.enter_context(TemporaryDirectory(prefix="dob-check-")))
        code, logs = logs_of(args, folder)
        if code:
            return code
        axes = _compared(logs, design, args.config)
    holds = all(axis["holds"] is True for axis in axes.values())
    if args.json:
        print(json.dumps({"axes": axes, "holds": holds}))
    else:
        print("\n".join(f"{axis}: {found['why']}" for axis, found in axes.items()))
    return 0 if holds else EXIT_NOT_HELD


def _compared(logs: list[Path], design: "DobDesign", config: Path | None) -> dict[str, dict[str, Any]]:
    from dob_companion.cli.identifying import longest, read_in_hover
    from dob_companion.identification.agreement import agreement, tolerance, verdict
    from dob_companion.identification.identify import identify

    wanted = tuple(axis for block in design.blocks for axis in block.axes)
    found = identify([longest(read_in_hover(log, config)) for log in logs], axes=wanted, rate_hz=1.0 / design.dt)
    axes: dict[str, dict[str, Any]] = {}
    for block in design.blocks:
        for axis in block.axes:
            response = found.axes[axis].response
            seen = agreement(axis, response, block, design.dt) if response is not None else None
            if seen is None:
                axes[axis] = {"holds": None, "why": f"cannot be told: {found.axes[axis].why}"}
                continue
            holds, why = verdict(seen, tolerance(block, design.dt))
            numbers = {"gain": seen.gain.to_object(), "delay_s": seen.delay_s.to_object(), "misfit": seen.misfit}
            axes[axis] = {"holds": holds, "why": why, **numbers}
    return axes
