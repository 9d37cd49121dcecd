"""The signing key: a file that nobody else may read."""

import os
import stat
from pathlib import Path

from dob_companion.errors import InputError
from dob_companion.mavlink.signing import KEY_BYTES

_FORM = f"expected {2 * KEY_BYTES} hexadecimal digits"


def read_key(path: Path) -> bytes:
    """The key of 32 bytes in `path`, written as 64 hexadecimal digits.

    Raises InputError, one line that never shows the content, when the file is not ours (or root's), when others may
    read or write it, or when it holds something else. What systemd hands over as a credential it protects itself.
    """
    try:
        with path.open("rb") as file:
            _check(path, os.fstat(file.fileno()))
            text = file.read(4 * KEY_BYTES).strip()
    except OSError as problem:
        raise InputError(f"signing key {path}: cannot be read: {problem.strerror}") from None
    try:
        key = bytes.fromhex(text.decode("ascii"))
    except ValueError:
        raise InputError(f"signing key {path}: {_FORM}") from None
    if len(key) != KEY_BYTES:
        raise InputError(f"signing key {path}: {_FORM}")
    return key


def _check(path: Path, status: os.stat_result) -> None:
    credentials = os.environ.get("CREDENTIALS_DIRECTORY")
    if credentials and path.parent == Path(credentials):
        return
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"signing key {path}: not a regular file")
    if status.st_uid not in (0, os.geteuid()):
        raise InputError(f"signing key {path}: belongs to user {status.st_uid}, expected {os.geteuid()} or root")
    mode = stat.S_IMODE(status.st_mode)
    if mode & 0o077:
        raise InputError(f"signing key {path}: has mode {mode:04o}, expected 0600: chmod 600 {path}")
