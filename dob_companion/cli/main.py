"""`dob-companion`: one program, one command each file of this room."""

import argparse
from collections.abc import Sequence
from types import ModuleType

from dob_companion import __version__
from dob_companion.cli.console import complain, console
from dob_companion.cli.extras import remedy
from dob_companion.errors import DobError, InputError

EXIT_INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command. Returns its exit code (docs/interfaces.md): 0, 1, 2 or 130."""
    with console() as verdict:
        try:
            return verdict(_run(argv))
        except SystemExit as leaving:  # of argparse, after help or usage
            code = leaving.code if isinstance(leaving.code, int) else 0
            raise SystemExit(verdict(code)) from None


def _run(argv: Sequence[str] | None) -> int:
    command = ""
    try:
        args = parser().parse_args(argv)
        command = args.command
        code: int = args.run(args)
    except DobError as problem:
        return _complain(str(problem), problem.exit_code)
    except ModuleNotFoundError as missing:
        what = remedy(missing, command)
        if what is None:
            raise
        return _complain(what, InputError.exit_code)
    except OSError as problem:  # a disk that is full or gone in the middle of the work
        where = f"{problem.filename}: " if problem.filename else ""
        return _complain(f"{where}{problem.strerror or problem}", DobError.exit_code)
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    except Exception as problem:  # Ctrl-C in the midst of an import can come out of a package as another error
        if not _interrupted(problem):
            raise
        return EXIT_INTERRUPTED
    return code


def _interrupted(problem: BaseException | None) -> bool:
    """Whether an error came up while Ctrl-C was handled."""
    while problem is not None and not isinstance(problem, KeyboardInterrupt):
        problem = problem.__context__
    return problem is not None


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
    from dob_companion.cli import (
        check,
        compare,
        demo,
        design,
        doctor,
        excite,
        identify,
        inspect,
        param,
        rehearse,
        replay,
        report,
        run,
        spec,
        status,
        tune,
    )

    return (
        *(demo, tune, excite, identify, spec, design, inspect, rehearse, compare),
        *(doctor, check, run, param, status, replay, report),
    )


def _complain(text: str, code: int) -> int:
    complain(text)
    return code
