"""`dob-companion tune`: from a hovering aircraft or its log to a certified design that was rehearsed."""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from dob_companion.cli.identification_options import add_options, add_source, options_of
from dob_companion.cli.run import DEFAULT_LINK


def add_parser(commands: Any) -> None:
    """Add `tune` to the command line."""
    parser = commands.add_parser(
        "tune",
        help="excite, identify, design and rehearse in one go",
        description="All of it, stopping at the first doubt: excite the hovering aircraft on a link, or take a log; "
        "identify it; design an observer for every aircraft within what is not known of it; fly that in simulation. "
        "Nothing is enabled: at the end stands the command that flies.",
        epilog="example: dob-companion tune --link udpin:127.0.0.1:14540 -o my-aircraft",
    )
    add_source(parser)
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help="where all results go")
    add_options(parser)
    parser.add_argument("--no-rehearsal", action="store_true", help="do not fly the design in simulation")
    parser.add_argument("--json", action="store_true", help="print the results as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Excite, identify, design, rehearse. Exit code 1 at the first doubt, which is said."""
    from dob_companion.cli.design import certificate_text, design_into
    from dob_companion.cli.identifying import SPEC, logs_of, of_logs, table
    from dob_companion.cli.rehearse import rehearse_into
    from dob_companion.errors import FlightFailedError, RefusedError
    from dob_companion.files import require_place

    require_place(args.out)
    code, logs = logs_of(args, args.out)
    if code:
        return code
    said = ", ".join(map(str, logs))
    _step("identify", said)
    outcome = of_logs(logs, options_of(args), args.config)
    outcome.write(args.out)
    _show(args, table(outcome))
    if outcome.spec is None:
        raise RefusedError(f"{said}: {outcome.why}; {args.out / 'identification.html'} says what to fly next")
    _step("design", str(args.out / SPEC))
    design, tunings = design_into(args.out, args.out / SPEC, auto=True)
    _show(args, certificate_text(design, tunings))
    if unproved := [block.name for block in design.blocks if block.certificate.extra.get("robust_stable") is False]:
        raise RefusedError(
            f"{args.out / 'design.json'}: not proved stable for all that is not known of {', '.join(unproved)}: excite "
            "longer or stronger, or ask for more margin in its spec"
        )
    result = outcome.to_object() | {"design": str(args.out / "design.json")}
    if not args.no_rehearsal:
        _step("rehearse", str(args.out))
        found, words, wrong = rehearse_into(args.out, args.out / "rehearsal")
        result |= {"rehearsal": found}
        _show(args, words)
        if wrong:
            raise FlightFailedError(wrong)
    if args.json:
        print(json.dumps(result))
    link = args.link or DEFAULT_LINK
    _show(args, f"it flies with: dob-companion run --design {args.out / 'design.json'} --link {link}")
    return 0


def _step(name: str, of: str) -> None:
    if sys.stderr.isatty():
        print(f"\n{name}: {of}", file=sys.stderr, flush=True)


def _show(args: argparse.Namespace, text: str) -> None:
    if not args.json:
        print(f"{text}\n", flush=True)
