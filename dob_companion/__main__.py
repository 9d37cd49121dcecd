"""`python -m dob_companion` is `dob-companion`."""

import sys

from dob_companion.cli.main import main

sys.exit(main())
