"""Writing a small file from a loop that must not wait for a disk."""

import threading
from collections.abc import Callable
from pathlib import Path

from dob_companion.errors import InputError
from dob_companion.files.atomic import write_text

PATIENCE_S = 3.0
"""How long leaving waits for a disk."""


class BackgroundWriter:
    """Keeps a file at the newest text put, in a thread of its own: the loop hands it over and goes on.

    A failure is said once, through `complain` in that thread, until a write succeeds again. Enter it before real-time
    scheduling is asked for, since a thread inherits that; leaving it writes what is left, if the disk still moves.
    """

    def __init__(self, path: Path, complain: Callable[[str], None]) -> None:
        self._path = path
        self._complain = complain
        self._failing = False
        self._pending: str | None = None
        self._closed = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._write_changes, name=f"writer of {path.name}", daemon=True)

    def __enter__(self) -> "BackgroundWriter":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(PATIENCE_S)

    def put(self, text: str) -> None:
        """The file is to hold this text; one that has not been written yet is replaced."""
        with self._changed:
            self._pending = text
            self._changed.notify()

    def _write_changes(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._pending is not None or self._closed)
                text, self._pending = self._pending, None
            if text is None:
                return
            self._write(text)

    def _write(self, text: str) -> None:
        try:
            write_text(self._path, text)
        except InputError as problem:
            if not self._failing:
                self._complain(f"{problem}: it will be missed after a restart")
            self._failing = True
        else:
            self._failing = False
