"""Which kind of file this is, by its first bytes: for commands that were given another one than they read."""

from pathlib import Path

from dob_companion.errors import InputError
from dob_companion.mavlink.outline import V1, V2

TRACE = "a recorded flight"

_BEGINNINGS = {
    b"\x1f\x8b": TRACE,
    b"ULog": "a PX4 log",
    b"\xa3\x95": "an ArduPilot log",
    b"MATLAB": "a .mat file",
    b"PK\x03\x04": "an archive",
    b"\x89PNG": "a picture",
    b"<!DO": "a page",
    b"<htm": "a page",
}
_STAMP = 8
_FRAMES = bytes((V1,)), bytes((V2,))


def kind_of(path: Path) -> str:
    """TRACE, what else it seems to be, or an empty text. Raises InputError, one line, when it cannot be read."""
    try:
        with path.open("rb") as file:
            start = file.read(_STAMP + 1)
    except OSError as problem:
        raise InputError(f"{path}: cannot be read: {problem.strerror}") from None
    if not start:
        return "an empty file"
    if start[_STAMP:] in _FRAMES and start[:1] == b"\0":  # µs of unix time begin with a zero until the year 4253
        return "a telemetry log"
    return next((kind for beginning, kind in _BEGINNINGS.items() if start.startswith(beginning)), "")


def require_trace(path: Path, others: str = "") -> None:
    """Raise InputError, one line that says what the file is, unless it is a recorded flight; `others` do as well."""
    kind = kind_of(path)
    if kind == TRACE:
        return
    expected = "expected a recorded flight (flight-NNNN-NNN.dobtrace)" + others
    beside = path.with_suffix(".dobtrace")
    hint = f"; {beside} lies beside it" if beside != path and beside.exists() else ""
    raise InputError(f"{path}: {kind or 'not a recorded flight'}, {expected}{hint}")
