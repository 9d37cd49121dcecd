"""The operator's settings on disk: recovered at the start, written whole or not at all, never waited for."""

import contextlib
from collections.abc import Mapping
from pathlib import Path

from dob_companion.companion.kept_parameters import dump_parameters, load_parameters
from dob_companion.errors import InputError
from dob_companion.files.atomic import make_directory, read_text
from dob_companion.files.background_writer import BackgroundWriter

NAME = "parameters.json"
DAMAGED = "parameters.json.damaged"
"""Where a file that cannot be used goes; the newest such file replaces an older one, so that the disk stays bounded."""


def recover_parameters(directory: Path) -> tuple[dict[str, float], str | None]:
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
        return load_parameters(read_text(path), str(path)), None
    except InputError as problem:
        with contextlib.suppress(OSError):
            path.replace(directory / DAMAGED)
        return {}, f"{problem}: starting with the configured values, kept as {DAMAGED}"


class ParameterKeeper:
    """Hands settings to a `BackgroundWriter` whenever the operator has changed one."""

    def __init__(self, writer: BackgroundWriter, recovered: Mapping[str, float]) -> None:
        self._writer = writer
        self._values = dict(recovered)
        self._seen: Mapping[str, float] | None = None

    def keep(self, written: Mapping[str, float]) -> None:
        """Take note of what the operator has written so far; costs nothing while it is the same mapping as before."""
        if written is self._seen:
            return
        self._seen = written
        values = {**self._values, **written}
        if values != self._values:
            self._values = values
            self._writer.put(dump_parameters(values))
