"""`python -m dob_companion` is `dob-companion`."""

import sys

from dob_companion.cli.interrupt import hold_ctrl_c_in_imports


def main() -> int:
    """The command line, from its first import on without an import that Ctrl-C cuts short."""
    hold_ctrl_c_in_imports()
    from dob_companion.cli.main import main as command_line

    return command_line()


if __name__ == "__main__":  # a process that designs an axis of several imports this too
    sys.exit(main())
