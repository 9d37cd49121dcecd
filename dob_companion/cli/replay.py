"""`dob-companion replay`: a recorded flight again, bit for bit."""

import argparse
import json
from pathlib import Path
from typing import Any


def add_parser(commands: Any) -> None:
    """Add `replay` to the command line."""
    parser = commands.add_parser(
        "replay",
        help="a recorded flight again, bit for bit",
        description="Make every recorded call to a companion built anew and compare every byte that it answers.",
        epilog="example: dob-companion replay flights/flight-0007-000.dobtrace",
    )
    parser.add_argument("trace", type=Path, metavar="TRACE", help="a segment, or a directory: its newest flight")
    parser.add_argument("--design", type=Path, metavar="FILE", help="refuse a flight of another design than this")
    parser.add_argument("--json", action="store_true", help="print the findings as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Play every segment to a replay. Returns 1 when something differs or a segment is damaged."""
    from dob_companion.artifact import loads
    from dob_companion.errors import InputError
    from dob_companion.files import read_text
    from dob_companion.files.kinds import require_trace
    from dob_companion.files.playback import play
    from dob_companion.files.segments import traces_at
    from dob_companion.flightlog.replay import Replay

    replay = Replay(loads(read_text(args.design), str(args.design)) if args.design else None)
    if not args.trace.is_dir():
        require_trace(args.trace)
    paths = traces_at(args.trace)
    differs_in = ""
    torn: list[str] = []
    damaged: dict[str, str] = {}
    for path in paths:
        try:
            ending = play(path, replay)
        except InputError as problem:
            raise InputError(str(problem) if str(path) in str(problem) else f"{path}: {problem}") from None
        torn += [str(path)] * ending.torn
        damaged |= {str(path): ending.damage} if ending.damage else {}
        if replay.difference:
            differs_in = str(path)
            break
    identical = not (replay.difference or damaged)
    if args.json:
        findings = {
            "identical": identical,
            "difference": f"{differs_in}: {replay.difference}" if replay.difference else None,
            "damaged": damaged,
            "torn": torn,
            **{name: getattr(replay, name) for name in _COUNTS},
        }
        print(json.dumps(findings))
        return 0 if identical else 1
    print(", ".join(f"{getattr(replay, name)} {name.replace('_', ' ')}" for name in _COUNTS))
    for path_name in torn:
        print(f"{path_name}: ends in the middle of a write; what was whole was read")
    for path_name, damage in damaged.items():
        print(f"{path_name}: damaged, what stands before was read: {damage}")
    print(f"{differs_in}: {replay.difference}" if replay.difference else "every byte that was said is computed again")
    return 0 if identical else 1


_COUNTS = ("turns", "messages", "corrections", "checkpoints", "lost_turns")
