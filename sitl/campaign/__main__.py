"""`python -m sitl.campaign`."""

import sys

from sitl.campaign.cli import main

if __name__ == "__main__":  # worker processes import this module again
    sys.exit(main())
