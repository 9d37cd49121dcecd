"""The command line: parse, call, print, exit code. Each command imports its wing only when it runs."""

import os

# Before numpy is loaded: our matrices are small, and threads that wait for each other only take time from the loop.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
