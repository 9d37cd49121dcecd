"""Files read with one clear complaint, and written whole or not at all."""

import contextlib
import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from dob_companion.errors import InputError
from dob_companion.files.kinds import kind_of


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
        kind = kind_of(path)
        what = f", but {kind}" if kind else f": byte {problem.start} cannot be decoded"
        raise InputError(f"{path}: not UTF-8 text{what}") from None


def reader_beside(path: Path) -> Callable[[str], bytes]:
    """Reads files by the names that `path` mentions: relative ones from its own directory."""
    return lambda name: read_bytes(path.parent / name)


def make_directory(path: Path) -> None:
    """Create a directory and its parents. Raises InputError when that cannot be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise InputError(f"{path}: cannot be made a directory: {problem.strerror}") from None


def remove(path: Path) -> None:
    """Remove a file, if there is one. Raises InputError when that cannot be."""
    try:
        path.unlink(missing_ok=True)
    except OSError as problem:
        raise InputError(f"{path}: cannot be removed: {problem.strerror}") from None


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text; see `write_bytes`."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, data: bytes) -> None:
    """Replace the file in one step: whoever reads it, at any moment, sees the old content or the new.

    The data are on disk before the name points at them. Raises InputError, and leaves the old file, when the
    directory is missing, the disk is full, or writing is not allowed.
    """
    with contextlib.ExitStack() as undone:
        staged = _staged(path, data, undone)
        _put(staged, path)
        undone.pop_all()


def require_place(folder: Path) -> None:
    """Ask before long work whether results can be written to `folder`, which need not exist. Raises InputError."""
    nearest = next(parent for parent in (folder.absolute(), *folder.absolute().parents) if parent.exists())
    if not nearest.is_dir() or not os.access(nearest, os.W_OK | os.X_OK):
        reason = "not a directory" if not nearest.is_dir() else "not allowed"
        raise InputError(f"{folder}: cannot be written to: {nearest} is {reason}")


def write_files(folder: Path, contents: Mapping[str, str | bytes]) -> None:
    """Write results, by their names relative to `folder`, all or none of them; the first is put in place last.

    Every byte is on disk before a name points at any. Raises InputError, and leaves what was there before, when the
    folder cannot be made, the disk is full, or writing is not allowed.
    """
    with contextlib.ExitStack() as undone:
        staged = []
        for name, content in contents.items():
            path = folder / name
            _made(path.parent, undone)
            if path.is_dir():
                raise InputError(f"{path}: cannot be written: it is a directory")
            data = content.encode("utf-8") if isinstance(content, str) else content
            staged.append((_staged(path, data, undone), path))
        for temporary, path in reversed(staged):
            _put(temporary, path)
        undone.pop_all()


def _put(temporary: Path, path: Path) -> None:
    try:
        temporary.replace(path)
    except OSError as problem:
        raise InputError(f"{path}: cannot be written: {problem.strerror}") from None


def _made(folder: Path, undone: contextlib.ExitStack) -> None:
    missing = [parent for parent in (folder, *folder.parents) if not parent.exists()]
    make_directory(folder)
    for parent in reversed(missing):
        undone.callback(_without_folder, parent)


def _without_folder(folder: Path) -> None:
    with contextlib.suppress(OSError):
        folder.rmdir()


def _without_file(path: Path) -> None:
    with contextlib.suppress(OSError):  # gone as it should be, or the disk with it
        path.unlink()


def _staged(path: Path, data: bytes, undone: contextlib.ExitStack) -> Path:
    """The data on disk in a file beside `path`."""
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        undone.callback(_without_file, Path(name))
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        Path(name).chmod(0o644)
    except OSError as problem:
        raise InputError(f"{path}: cannot be written: {problem.strerror}") from None
    return Path(name)
