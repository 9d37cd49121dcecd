"""The log when it goes to a file: waits for the disk in the loop's place.

`python -m dob_companion.view.log FD`, fed on standard input, writes to the descriptor FD that it has inherited. Lines
that the disk does not take are left out and counted.
"""

import os
import sys

from dob_companion.view.inlet import batches, stand_back

_EVERY_S = 60.0


def main(fd: int) -> None:
    """Write until the feed ends."""
    stand_back()
    left_out = 0
    for lines in batches(_EVERY_S):
        for line in lines:
            told = b"(%d lines left out)\n" % left_out if left_out else b""
            left_out = 0 if _written(fd, told + line + b"\n") else left_out + 1


def _written(fd: int, data: bytes) -> bool:
    begun = False
    while data:
        try:
            data = data[os.write(fd, data) :]
        except OSError:
            if begun:  # half a line stands there; the next one begins on a line of its own
                _written(fd, b"\n")
            return False
        begun = True
    return True


if __name__ == "__main__":
    main(int(sys.argv[1]))
