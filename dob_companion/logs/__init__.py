"""What other programs wrote down of a flight, each kind of file read into one `identification.record.Record`."""

import gzip
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

from dob_companion.errors import InputError, LogError
from dob_companion.files.kinds import kind_of
from dob_companion.identification.record import Record
from dob_companion.logs.ardupilot import read_bin, read_text
from dob_companion.logs.dataflash import looks_binary, looks_text
from dob_companion.logs.dobtrace import read_dobtrace
from dob_companion.logs.px4 import looks_like_ulog, read_ulog
from dob_companion.logs.table import looks_like_csv, read_csv, read_npz
from dob_companion.logs.tlog import looks_like_tlog, read_tlog
from dob_companion.mavlink.axes import IN_HOVER, VehicleAxes

__all__ = ["read_log", "reader_for"]

_BEGIN = 1 << 16
_PRINTED = set(b"\t\r\n" + bytes(range(32, 127)))


def _read_compressed(path: Path) -> tuple[Record, ...]:
    """A segment of ours, which is compressed. Raises LogError where what is compressed is another kind of log."""
    try:
        with gzip.open(path) as file:
            begin = file.read(1 << 12)
    except (OSError, EOFError, zlib.error):
        begin = b""
    if any(looks_like(begin) for looks_like, _ in _KINDS) or (begin and not set(begin) - _PRINTED):
        raise LogError(f"{path}: a log that is compressed: unpack it first (gunzip)")
    return read_dobtrace(path)


_KINDS: tuple[tuple[Callable[[bytes], bool], Callable[[Path], tuple[Record, ...]]], ...] = (
    (lambda begin: begin.startswith(b"\x1f\x8b"), _read_compressed),
    (lambda begin: begin.startswith(b"PK\x03\x04"), read_npz),
    (looks_like_ulog, read_ulog),
    (looks_binary, read_bin),
    (looks_like_tlog, read_tlog),
    (looks_text, read_text),
    (looks_like_csv, read_csv),
)
_READ = ("a PX4 log", "an ArduPilot log", "a telemetry log")
_EXPECTED = "a PX4 .ulg, an ArduPilot .bin or .log, a .tlog, a .dobtrace, or a table as .csv or .npz"


def read_log(path: Path, axes: VehicleAxes = IN_HOVER) -> tuple[Record, ...]:
    """The records in a log, whatever kind it is: that is told by its content, not by its name.

    There is one record for each stretch in which one clock holds. A directory is one of recorded flights: its newest is
    read. `axes` are those in which the vehicle of a telemetry log speaks; our own recordings say theirs, and what
    autopilots log is in those of hover. Raises InputError (LogError where the content is at fault), one line that names
    the file and what is wrong.
    """
    read = reader_for(path)
    try:
        return read_tlog(path, axes) if read is read_tlog else read(path)
    except InputError as problem:
        words = " ".join(str(problem).split())
        raise type(problem)(words if words.startswith(str(path)) else f"{path}: {words}") from None
    except (ArithmeticError, LookupError, ValueError, TypeError, struct.error, MemoryError) as problem:
        words = " ".join(str(problem).split())
        raise LogError(f"{path}: damaged in a way that no reader knows: {type(problem).__name__}: {words}") from None


def reader_for(path: Path) -> Callable[[Path], tuple[Record, ...]]:
    """What reads this kind of file. Raises InputError, one line, when it is of none."""
    if path.is_dir():
        return read_dobtrace
    kind = kind_of(path)
    with path.open("rb") as file:
        begin = file.read(_BEGIN)
    for looks_like, read in _KINDS:
        if looks_like(begin):
            return read
    if kind in _READ:
        raise LogError(f"{path}: seems to be {kind}, but does not begin as one")
    raise LogError(f"{path}: {kind or 'of no known kind'}, expected {_EXPECTED}")
