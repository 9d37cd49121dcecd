"""Ctrl-C, held until an import is over.

One that comes in the midst of an import can be lost in a package that catches everything while it looks for something
optional, or come out of a compiled module as another error ("could not import module datetime").
"""

import signal
import threading
from types import FrameType

LOOK_S = 0.02
"""How soon the end of an import is looked for again."""

_IMPORTING = "<frozen importlib._bootstrap>"


def hold_ctrl_c_in_imports() -> None:
    """From now on, where Ctrl-C is what Python makes of it, and in the thread that Python tells of it."""
    if threading.current_thread() is not threading.main_thread():
        return
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _met)


def _met(number: int, frame: FrameType | None) -> None:
    if not _importing(frame):
        signal.default_int_handler(number, frame)
    again = threading.Timer(LOOK_S, signal.pthread_kill, (threading.main_thread().ident, number))
    again.daemon = True
    again.start()


def _importing(frame: FrameType | None) -> bool:
    while frame is not None and frame.f_code.co_filename != _IMPORTING:
        frame = frame.f_back
    return frame is not None
