"""A network namespace with nothing but a loopback, for simulators that bind every address of the machine.

What goes on in it ends with who asked for it, however that ends, and in good order: the daemon, the simulator and
their sockets go as they do at the end of a flight.
"""

import ctypes
import os
import signal
import subprocess
import sys
from typing import NoReturn

INSIDE = "DOB_FLIGHT_INSIDE"
"""In the environment of a program that is in such a namespace: the process that asked for it."""

SET_PARENT_DEATH_SIGNAL = 1


def go_inside(module: str) -> None:
    """Go on in one: outside of it, run this module there with the same arguments and exit as it does.

    Linux only, and root or user namespaces.
    """
    if INSIDE not in os.environ:
        asked = os.environ | {INSIDE: str(os.getpid())}
        sys.exit(subprocess.run(command("-m", module, *sys.argv[1:]), env=asked, check=False).returncode)
    end_with(int(os.environ[INSIDE]))


def command(*arguments: object) -> list[str]:
    """What runs a Python module in a namespace, in one process from the first to the last."""
    enter = ["unshare", "--net"] + ([] if os.geteuid() == 0 else ["--map-root-user"])
    return [*enter, "sh", "-c", 'ip link set lo up && exec "$@"', "sh", sys.executable, *map(str, arguments)]


def end_with(parent: int) -> None:
    """Exit, instead of being killed, at SIGTERM, which comes as well when this parent ends, even by SIGKILL."""
    signal.signal(signal.SIGTERM, _exit)
    ctypes.CDLL(None).prctl(SET_PARENT_DEATH_SIGNAL, signal.SIGTERM)
    if os.getppid() != parent:  # it has ended already
        _exit()


def _exit(*_: object) -> NoReturn:
    sys.exit(128 + signal.SIGTERM)
