"""`python -m sitl.sweep`."""

import sys

from sitl.sweep.cli import main

if __name__ == "__main__":
    sys.exit(main())
