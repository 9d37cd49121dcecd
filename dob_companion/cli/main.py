"""`dob-companion`: one program, one command each file of this room."""

import argparse
import os
import sys
from collections.abc import Sequence
from types import ModuleType

from dob_companion import __version__
from dob_companion.errors import DobError, InputError

EXIT_INTERRUPTED = 130

_EXTRA_OF = {"cvxpy": "design", "clarabel": "design", "control": "design", "scipy": "design", "matplotlib": "design"}
_EXTRA_OF |= {"jinja2": "design", "mavsdk": "mavsdk", "rich": "view", "sitl": "sitl"}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command. Returns its exit code (docs/interfaces.md): 0, 1, 2 or 130."""
    try:
        args = parser().parse_args(argv)
        code: int = args.run(args)
        sys.stdout.flush()
    except DobError as problem:
        return _complain(str(problem), problem.exit_code)
    except ModuleNotFoundError as missing:
        extra = _EXTRA_OF.get((missing.name or "").partition(".")[0])
        if extra is None:
            raise
        return _complain(f"{missing.name} is not installed: pip install 'dob-companion[{extra}]'", InputError.exit_code)
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone, as in `… | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return code


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    top = argparse.ArgumentParser(
        prog="dob-companion",
        description="Design a certified disturbance observer, fly it over MAVLink, switch it with a parameter.",
        epilog="example: dob-companion demo --fast",
    )
    top.add_argument("--version", action="version", version=f"dob-companion {__version__}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for module in command_modules():
        module.add_parser(commands)
    return top


def command_modules() -> tuple[ModuleType, ...]:
    """The commands, in the order of their help. Imported only now: Ctrl-C meanwhile is then met as it is later."""
    from dob_companion.cli import compare, demo, design, doctor, inspect, param, replay, report, run, status

    return demo, design, inspect, compare, doctor, run, param, status, replay, report


def _complain(text: str, code: int) -> int:
    print(f"dob-companion: {' '.join(text.split())}", file=sys.stderr)
    return code
