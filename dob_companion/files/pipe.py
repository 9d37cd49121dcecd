"""A pipe to the scribe that never waits: what does not fit is refused whole, and what has begun is finished first."""

import contextlib
import fcntl
import os
import select
import subprocess
import sys

PIPE_BYTES = 1 << 20
"""What an unprivileged process may ask for (/proc/sys/fs/pipe-max-size): many seconds of flight."""


class ScribePipe:
    """Starts the scribe and holds the writing end of its standard input."""

    def __init__(self, arguments: list[str]) -> None:
        reading, self._fd = os.pipe()
        os.set_blocking(self._fd, False)
        with contextlib.suppress(OSError):
            fcntl.fcntl(self._fd, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "dob_companion.files.scribe", *arguments],
            stdin=reading,
            stdout=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C is the daemon's; the scribe leaves when the daemon has
        )
        os.close(reading)
        self._rest = b""
        self.broken = False

    @property
    def pid(self) -> int:
        """Process id of the scribe."""
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
        """Hand over what has begun and let the scribe end; each takes `patience_s` at most."""
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
