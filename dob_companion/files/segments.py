"""Where the segments of recorded flights lie, how they are named, and which are dropped when there are too many."""

import contextlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from dob_companion.errors import InputError

_NAME = re.compile(r"flight-(\d+)-(\d+)\.(?:dobtrace|tlog)")
_PIECE = 1 << 16


@dataclass(frozen=True, slots=True, order=True)
class SegmentName:
    """One segment: `flight-0007-002.dobtrace` and the `.tlog` beside it. Sorted oldest first."""

    directory: Path
    flight: int
    index: int

    @property
    def trace(self) -> Path:
        """The file that can be replayed."""
        return self.directory / f"flight-{self.flight:04d}-{self.index:03d}.dobtrace"

    @property
    def tlog(self) -> Path:
        """The same messages, for ground stations."""
        return self.trace.with_suffix(".tlog")

    def remove(self) -> None:
        """Delete both files, as far as they are there."""
        for path in (self.trace, self.tlog):
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)


def segments_in(directory: Path) -> list[SegmentName]:
    """The segments of a directory, oldest first. Raises OSError when it cannot be read."""
    matches = [_NAME.fullmatch(path.name) for path in directory.iterdir()]
    return sorted({SegmentName(directory, int(match[1]), int(match[2])) for match in matches if match})


def next_flight(directory: Path) -> int:
    """The number of the flight that is recorded next: numbers need no clock, which a computer may not have."""
    return 1 + max((name.flight for name in segments_in(directory)), default=0)


def prune(directory: Path, keep: int) -> None:
    """Delete the oldest segments until at most `keep` are left."""
    names = segments_in(directory)
    for name in names[: max(0, len(names) - keep)]:
        name.remove()


def traces_at(path: Path) -> list[Path]:
    """The segments to read: the file itself, or those of the newest flight of a directory, oldest first.

    Raises InputError, one line, when there is nothing to read.
    """
    if not path.is_dir():
        return [path]
    try:
        names = [name for name in segments_in(path) if name.trace.exists()]
    except OSError as problem:
        raise InputError(f"{path}: cannot be read: {problem.strerror}") from None
    if not names:
        raise InputError(f"{path}: holds no recorded flight, expected files named flight-NNNN-NNN.dobtrace")
    return [name.trace for name in names if name.flight == names[-1].flight]


def chunks(path: Path) -> Iterator[bytes]:
    """A file's bytes in pieces. Raises InputError, one line, when it cannot be read."""
    try:
        with path.open("rb") as file:
            while piece := file.read(_PIECE):
                yield piece
    except OSError as problem:
        raise InputError(f"{path}: cannot be read: {problem.strerror}") from None
