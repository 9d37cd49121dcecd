"""A pipe to a process of ours that never waits: what does not fit is refused whole, what has begun is finished first.

So a flight recorder and whoever shows a flight get what the loop knows, and none of them can hold it up.
"""

import contextlib
import fcntl
import os
import select
import subprocess
import sys
from collections.abc import Sequence

PIPE_BYTES = 1 << 20
"""What an unprivileged process may ask for (/proc/sys/fs/pipe-max-size): many seconds of flight."""


class ProcessPipe:
    """Starts `python -m MODULE ARGUMENTS…` and holds the writing end of its standard input.

    The process inherits standard error and the descriptors `keep`, and leaves when its input ends. The pipe takes
    `size` bytes where the system grants it.
    """

    def __init__(
        self, module: str, arguments: Sequence[str] = (), *, size: int = PIPE_BYTES, keep: Sequence[int] = ()
    ) -> None:
        reading, self._fd = os.pipe()
        os.set_blocking(self._fd, False)
        with contextlib.suppress(OSError):
            fcntl.fcntl(self._fd, fcntl.F_SETPIPE_SZ, size)
        self._process = subprocess.Popen(
            [sys.executable, "-m", module, *arguments],
            stdin=reading,
            stdout=subprocess.DEVNULL,
            pass_fds=keep,
            start_new_session=True,  # Ctrl-C is the daemon's; the process leaves when the daemon has
        )
        os.close(reading)
        self._rest = b""
        self.broken = False

    @property
    def pid(self) -> int:
        """Process id of the reader."""
        return self._process.pid

    def send(self, data: bytes) -> bool:
        """Hand data over, or nothing of it: False when there is no room or, with `broken`, nobody to read it."""
        if self.broken or not self._finish():
            return False
        written = self._write(data)
        if written:
            self._rest = data[written:]
        return written > 0

    def close(self, patience_s: float) -> None:
        """Hand over what has begun and let the process end; each takes `patience_s` at most."""
        if self._rest and not self.broken:
            select.select([], [self._fd], [], patience_s)
            self._finish()
        os.close(self._fd)
        self.broken = True
        with contextlib.suppress(subprocess.TimeoutExpired):  # a dead disk must not keep the daemon from leaving
            self._process.wait(patience_s)

    def _finish(self) -> bool:
        while self._rest and (written := self._write(self._rest)):
            self._rest = self._rest[written:]
        return not self._rest

    def _write(self, data: bytes) -> int:
        try:
            return os.write(self._fd, data)
        except BlockingIOError:
            return 0
        except BrokenPipeError:
            self.broken, self._rest = True, b""
            return 0


class ScribePipe(ProcessPipe):
    """The pipe to the flight recorder's process."""

    def __init__(self, arguments: Sequence[str]) -> None:
        super().__init__("dob_companion.files.scribe", arguments)
