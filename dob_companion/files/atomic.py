"""Files read with one clear complaint, and written whole or not at all."""

import contextlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

from dob_companion.errors import InputError


def read_bytes(path: Path) -> bytes:
    """The file's content. Raises InputError, one line, when it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as problem:
        raise InputError(f"{path}: cannot be read: {problem.strerror}") from None


def read_text(path: Path) -> str:
    """The file's content as UTF-8. Raises InputError, one line, when it cannot be read or is not UTF-8."""
    try:
        return read_bytes(path).decode("utf-8")
    except UnicodeDecodeError as problem:
        raise InputError(f"{path}: not UTF-8 text: byte {problem.start} cannot be decoded") from None


def reader_beside(path: Path) -> Callable[[str], bytes]:
    """Reads files by the names that `path` mentions: relative ones from its own directory."""
    return lambda name: read_bytes(path.parent / name)


def make_directory(path: Path) -> None:
    """Create a directory and its parents. Raises InputError when that cannot be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise InputError(f"{path}: cannot be made a directory: {problem.strerror}") from None


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text; see `write_bytes`."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, data: bytes) -> None:
    """Replace the file in one step: whoever reads it, at any moment, sees the old content or the new.

    The data are on disk before the name points at them. Raises InputError, and leaves the old file, when the
    directory is missing, the disk is full, or writing is not allowed.
    """
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except OSError as problem:
        raise InputError(f"{path}: cannot be written: {problem.strerror}") from None
    finally:
        if temporary is not None:
            with contextlib.suppress(FileNotFoundError):
                Path(temporary).unlink()
