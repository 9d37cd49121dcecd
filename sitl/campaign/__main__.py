"""`python -m sitl.campaign`."""

import sys

if __name__ == "__main__":  # worker processes import this module again, and need nothing of it
    from sitl.campaign.cli import main

    sys.exit(main())
