"""The operator's settings on disk: recovered at the start, written whole or not at all, never waited for."""

import contextlib
import threading
from collections.abc import Callable, Mapping
from pathlib import Path

from dob_companion.companion.settings import dump_settings, load_settings
from dob_companion.errors import InputError
from dob_companion.files.atomic import make_directory, read_text, write_text

NAME = "parameters.json"
DAMAGED = "parameters.json.damaged"
"""Where a file that cannot be used goes; the newest such file replaces an older one, so that the disk stays bounded."""


def recover_settings(directory: Path) -> tuple[dict[str, float], str | None]:
    """The settings kept in `directory`, which is made if need be, and a warning if what was there is of no use.

    A damaged file is moved aside and nothing is recovered. Raises InputError when the directory cannot be made.
    """
    make_directory(directory)
    path = directory / NAME
    for left_over in directory.glob(f".{NAME}.*"):  # of a write that a loss of power cut short
        with contextlib.suppress(OSError):
            left_over.unlink()
    if not path.exists():
        return {}, None
    try:
        return load_settings(read_text(path), str(path)), None
    except InputError as problem:
        with contextlib.suppress(OSError):
            path.replace(directory / DAMAGED)
        return {}, f"{problem}: starting with the configured values, kept as {DAMAGED}"


class SettingsKeeper:
    """Writes settings in a thread of its own: the loop hands them over and goes on, however slow the disk.

    Only the newest values are written; a failure is said once, through `complain`, until a write succeeds again.
    Start it before real-time scheduling is asked for, since a thread inherits that.
    """

    def __init__(self, directory: Path, recovered: Mapping[str, float], complain: Callable[[str], None]) -> None:
        self._path = directory / NAME
        self._values = dict(recovered)
        self._complain = complain
        self._failing = False
        self._seen: Mapping[str, float] | None = None
        self._pending: dict[str, float] | None = None
        self._closed = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._write_changes, name="settings", daemon=True)

    def __enter__(self) -> "SettingsKeeper":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Write what is left, then end."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join()

    def keep(self, written: Mapping[str, float]) -> None:
        """Take note of what the operator has written so far; costs nothing while it is the same mapping as before."""
        if written is self._seen:
            return
        self._seen = written
        values = {**self._values, **written}
        if values != self._values:
            with self._changed:
                self._values = self._pending = values
                self._changed.notify()

    def _write_changes(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._pending is not None or self._closed)
                values, self._pending = self._pending, None
            if values is None:
                return
            self._write(values)

    def _write(self, values: Mapping[str, float]) -> None:
        try:
            write_text(self._path, dump_settings(values))
        except InputError as problem:
            if not self._failing:
                self._complain(f"{problem}: parameters will not survive a restart")
            self._failing = True
        else:
            self._failing = False
