"""A telemetry log written from a loop that must not wait for a disk."""

import os
import threading
from pathlib import Path

from dob_companion.errors import InputError
from dob_companion.files.atomic import make_directory
from dob_companion.files.tlog import Splitter, entry

WRITE_EVERY_S = 0.2
MOST_WAITING = 8 << 20
"""Bytes that may wait for the disk: minutes of a link. When there are more, the log has ended."""

PATIENCE_S = 5.0
"""How long leaving waits for a disk."""


class TlogWriter:
    """Keeps what passes on a link, in both directions; a thread of its own writes it.

    Raises InputError, one line, where the file cannot be made, or is there: a log of a flight is not replaced.
    `datagrams` tells whether what is heard comes in whole datagrams. Enter it before real-time scheduling is asked for,
    since a thread inherits that.
    """

    def __init__(self, path: Path, *, datagrams: bool) -> None:
        make_directory(path.parent)
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        except FileExistsError:
            raise InputError(f"{path}: exists; expected a directory without a recording") from None
        except OSError as problem:
            raise InputError(f"{path}: cannot be written: {problem.strerror}") from None
        self.trouble = ""
        """Why the log has ended before its time, in words; "" while it goes on."""
        self._path = path
        self._heard, self._said = Splitter(datagrams=datagrams), Splitter(datagrams=True)
        self._waiting = bytearray()
        self._closed = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._write_all, name=f"writer of {path.name}", daemon=True)

    def __enter__(self) -> "TlogWriter":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(PATIENCE_S)
        if self._thread.is_alive():
            self.trouble = self.trouble or f"{self._path}: the disk does not answer"

    def heard(self, data: bytes, unix_s: float) -> None:
        """These bytes have come in."""
        self._keep(self._heard, data, unix_s)

    def said(self, data: bytes, unix_s: float) -> None:
        """This message goes out."""
        self._keep(self._said, data, unix_s)

    def _keep(self, splitter: Splitter, data: bytes, unix_s: float) -> None:
        entries = b"".join(entry(unix_s, frame) for frame in splitter.frames(data))
        with self._changed:
            if self.trouble:
                return
            if len(self._waiting) + len(entries) > MOST_WAITING:
                self.trouble = f"{self._path}: the disk does not keep up"
                return
            self._waiting += entries

    def _write_all(self) -> None:
        closed = False
        while not closed:
            with self._changed:
                self._changed.wait_for(lambda: self._closed, WRITE_EVERY_S)
                closed, data = self._closed, bytes(self._waiting)
                self._waiting.clear()
            try:
                while data:
                    data = data[os.write(self._file, data) :]
            except OSError as problem:
                self.trouble = f"{self._path}: cannot be written: {problem.strerror}"
                break
        os.close(self._file)
