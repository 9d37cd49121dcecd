"""`python -m dob_companion` is `dob-companion`."""

import sys

from dob_companion.cli.main import main

if __name__ == "__main__":  # a process that designs an axis of several imports this too
    sys.exit(main())
