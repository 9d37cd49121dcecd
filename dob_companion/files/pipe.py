"""A pipe to a process of ours that never waits: what does not fit is refused whole, what has begun is finished first.

So a flight recorder and whoever shows a flight get what the loop knows, and none of them can hold it up.
"""

import contextlib
import fcntl
import os
import select
import subprocess
import sys
from collections.abc import Callable, Sequence

from dob_companion.errors import InputError

PIPE_BYTES = 1 << 20
"""What an unprivileged process may ask for (/proc/sys/fs/pipe-max-size): many seconds of flight."""


class WholePieces:
    """Gives pieces to `write`, which returns how many bytes were taken: each whole or not at all."""

    def __init__(self, write: Callable[[bytes], int]) -> None:
        self._write = write
        self._rest = b""

    def send(self, data: bytes) -> bool:
        """Whether the piece was taken; when only a part could be, the rest of it goes first the next time."""
        if not self.finish():
            return False
        written = self._write(data)
        self._rest = data[written:] if written else b""
        return written > 0

    def finish(self) -> bool:
        """Go on with what has begun; whether nothing of it is left."""
        while self._rest and (written := self._write(self._rest)):
            self._rest = self._rest[written:]
        return not self._rest

    def forget(self) -> None:
        """What has begun can never be finished."""
        self._rest = b""


class ProcessPipe:
    """Starts `python -m MODULE ARGUMENTS…` and holds the writing end of its standard input.

    The process inherits standard error and the descriptors `keep`, and leaves when its input ends. The pipe takes
    `size` bytes where the system grants it. Raises InputError, one line, when the process cannot be started.
    """

    def __init__(
        self, module: str, arguments: Sequence[str] = (), *, size: int = PIPE_BYTES, keep: Sequence[int] = ()
    ) -> None:
        reading, self._fd = os.pipe()
        os.set_blocking(self._fd, False)
        with contextlib.suppress(OSError):
            fcntl.fcntl(self._fd, fcntl.F_SETPIPE_SZ, size)
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-m", module, *arguments],
                stdin=reading,
                stdout=subprocess.DEVNULL,
                pass_fds=keep,
                start_new_session=True,  # Ctrl-C is the daemon's; the process leaves when the daemon has
            )
        except OSError as problem:
            os.close(self._fd)
            raise InputError(f"{module}: its process cannot be started: {problem.strerror}") from None
        finally:
            os.close(reading)
        self._pieces = WholePieces(self._write)
        self.broken = False

    @property
    def pid(self) -> int:
        """Process id of the reader."""
        return self._process.pid

    def send(self, data: bytes) -> bool:
        """Hand data over, or nothing of it: False when there is no room or, with `broken`, nobody to read it."""
        return not self.broken and self._pieces.send(data)

    def close(self, patience_s: float) -> None:
        """Hand over what has begun and let the process end; each takes `patience_s` at most."""
        if not self.broken and not self._pieces.finish():
            select.select([], [self._fd], [], patience_s)
            self._pieces.finish()
        os.close(self._fd)
        self.broken = True
        with contextlib.suppress(subprocess.TimeoutExpired):  # a dead disk must not keep the daemon from leaving
            self._process.wait(patience_s)

    def _write(self, data: bytes) -> int:
        try:
            return os.write(self._fd, data)
        except BlockingIOError:
            return 0
        except OSError:
            self.broken = True
            self._pieces.forget()
            return 0


class ScribePipe(ProcessPipe):
    """The pipe to the flight recorder's process."""

    def __init__(self, arguments: Sequence[str]) -> None:
        super().__init__("dob_companion.files.scribe", arguments)
