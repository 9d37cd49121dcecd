"""Standard output and error as a loop may write to them that must never wait.

O_NONBLOCK belongs to what was opened, not to the descriptor, so that setting it on standard error would set it for the
shell as well. A pipe or a terminal is therefore opened again for us alone. A socket, as under systemd, can be asked for
each piece. A file knows no such thing, and the disk below it may stand still whenever it likes: a process of its own
waits for it in our place, as it does for whatever cannot be opened again.
"""

import contextlib
import os
import select
import socket
import stat

from dob_companion.files.pipe import PIPE_BYTES, ProcessPipe, WholePieces

LAST_WORDS_S = 1.0
"""On leaving, how long the other end has to take what has begun."""


class Outlet:
    """Writes to what `fd` stands for; `fd` itself stays as it is."""

    def __init__(self, fd: int) -> None:
        self._own = -1
        self._socket: socket.socket | None = None
        self._process: ProcessPipe | None = None
        self._pieces = WholePieces(self._write)
        kind = os.fstat(fd).st_mode
        if stat.S_ISSOCK(kind):
            self._socket = socket.socket(fileno=os.dup(fd))
        elif not stat.S_ISREG(kind):
            with contextlib.suppress(OSError):
                flags = os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
                self._own = os.open(f"/proc/self/fd/{fd}", flags)
        if self._socket is None and self._own < 0:
            own = os.dup(fd)  # in that process standard output is another one
            try:
                self._process = ProcessPipe("dob_companion.view.log", [str(own)], size=PIPE_BYTES, keep=[own])
            finally:
                os.close(own)

    def send(self, data: bytes) -> bool:
        """Write all of it or nothing: False when there is no room, or nothing that takes it."""
        return self._process.send(data) if self._process is not None else self._pieces.send(data)

    def close(self) -> None:
        """Finish what has begun, if that can be, and let go."""
        if self._process is not None:
            self._process.close(LAST_WORDS_S)
        elif not self._pieces.finish():
            select.select([], [self._socket or self._own], [], LAST_WORDS_S)
            self._pieces.finish()
        if self._socket is not None:
            self._socket.close()
        if self._own >= 0:
            os.close(self._own)

    def _write(self, data: bytes) -> int:
        try:
            if self._socket is not None:
                return self._socket.send(data, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
            return os.write(self._own, data)
        except BlockingIOError:
            return 0
        except OSError:  # no reader, no room on the disk, no terminal: another line may fare better
            self._pieces.forget()
            return 0
