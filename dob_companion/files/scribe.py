"""The scribe: a process of its own that turns the frames on its standard input into segments on disk.

`python -m dob_companion.files.scribe DIR FLIGHT SEGMENT_BYTES SEGMENTS`

A process and not a thread, for three reasons: a slow or full disk, zlib and fsync can never hold the loop's
interpreter lock; what the loop has handed over survives even a `kill -9` of the daemon, because it stands in a pipe
that this process reads to its end; and the pipe itself is the bounded queue.
"""

import contextlib
import json
import os
import select
import signal
import sys
import time
import zlib
from pathlib import Path

from dob_companion.files.segments import SegmentName, prune
from dob_companion.files.tlog import Splitter, entry
from dob_companion.files.trace import GZIP, FrameReader, Kind, count_item, frame, items

SYNC_S = 2.0
"""Wall time between two fdatasync: what a loss of power may cost at most."""

NAP_S = 0.05
"""Wall time between two looks into the pipe. Waiting in `read` instead would wake this process at every turn of the
loop, on the loop's own core as often as not."""

_PIECE = 1 << 16


class Segment:
    """One open pair of files, `.dobtrace` and `.tlog`. Every method may raise OSError."""

    def __init__(self, name: SegmentName, header: dict[str, object]) -> None:
        self.name = name
        self.size = 0
        self._unix_offset = float(str(header["unix_offset"]))
        self._splitter = Splitter(datagrams=bool(header["datagrams"]))
        self._zip = zlib.compressobj(1, wbits=GZIP)
        self._log = bytearray()
        self._now = 0.0
        self._files: list[int] = []
        for path in (name.trace, name.tlog):
            self._files.append(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o644))
        self._packed = bytearray()
        self.unwritten = 0

    def add(self, payload: bytes) -> None:
        """Take a frame; it reaches the disk with the next `flush`."""
        self._packed += self._zip.compress(frame([payload]))
        for each in items(payload):
            match each.kind:
                case Kind.TOOK:
                    self.unwritten += 1
                case Kind.TIME:
                    self._now = each.seconds
                case Kind.RECEIVED:
                    for message in self._splitter.frames(each.data):
                        self._log += entry(self._unix_offset + self._now, message)
                case Kind.SAID:
                    self._log += entry(self._unix_offset + self._now, each.data)

    def flush(self) -> None:
        """Write everything taken so far, so that it can be read whatever happens next."""
        self._packed += self._zip.flush(zlib.Z_SYNC_FLUSH)
        self._write()

    def sync(self) -> None:
        """Let what was written survive a loss of power."""
        for file in self._files:
            os.fdatasync(file)

    def close(self) -> None:
        """End both files in order."""
        self._packed += self._zip.flush(zlib.Z_FINISH)
        self._write()
        self.sync()
        self.abandon()

    def abandon(self) -> None:
        """Let go of the files as they are."""
        for file in self._files:
            with contextlib.suppress(OSError):
                os.close(file)
        self._files = []

    def _write(self) -> None:
        for file, data in zip(self._files, (self._packed, self._log), strict=True):
            self.size += _write_whole(file, data)
            data.clear()
            self.unwritten = 0  # the trace comes first


def _write_whole(file: int, data: bytearray) -> int:
    """Write all of it, or leave the file as it was."""
    before, rest = os.lseek(file, 0, os.SEEK_CUR), memoryview(bytes(data))
    try:
        while rest:
            rest = rest[os.write(file, rest) :]
    except OSError:
        os.ftruncate(file, before)
        raise
    return len(data)


class Scribe:
    """Opens, fills and rotates segments. A disk that fails costs records, never more: they are counted, one line says
    so, and writing begins again, in a segment of its own, with the next checkpoint that finds room."""

    def __init__(self, directory: Path, flight: int, segment_bytes: int, segments: int) -> None:
        self.lost = 0
        self._directory, self._flight = directory, flight
        self._segment_bytes, self._segments = segment_bytes, segments
        self._header = b""
        self._index = 0
        self._segment: Segment | None = None
        self._untold = 0
        self._warned = False
        self._sync_at = 0.0

    def take(self, payload: bytes) -> None:
        """One frame from the loop."""
        kind = payload[0]
        if kind == Kind.HEADER:
            self._header = payload
            return
        if kind == Kind.LOST:
            self.lost += items(payload)[0].count
        try:
            if kind == Kind.CHECKPOINT and (self._segment is None or self._segment.size >= self._segment_bytes):
                self._rotate(payload)
            elif self._segment is not None:
                self._segment.add(payload)
            else:
                self._untold += sum(each.kind is Kind.TOOK for each in items(payload))
        except OSError as problem:
            self._fail(problem)

    def flush(self) -> None:
        """Write what has been taken."""
        if self._segment is None:
            return
        try:
            self._segment.flush()
            if time.monotonic() >= self._sync_at:
                self._segment.sync()
                self._sync_at = time.monotonic() + SYNC_S
        except OSError as problem:
            self._fail(problem)

    def close(self) -> None:
        """The loop has gone: end the segment."""
        try:
            if self._segment is not None:
                self._segment.close()
        except OSError as problem:
            self._fail(problem)
        self.lost += self._untold

    def _rotate(self, checkpoint: bytes) -> None:
        if self._segment is not None:
            self._segment.close()
            self._segment = None
        prune(self._directory, self._segments - 1)
        name = SegmentName(self._directory, self._flight, self._index)
        segment = None
        try:
            segment = Segment(name, json.loads(items(self._header)[0].data))
            segment.add(self._header)
            if self._untold:
                segment.add(count_item(self._untold))
            segment.add(checkpoint)
            segment.flush()
        except OSError:
            if segment is not None:
                segment.abandon()
            name.remove()
            raise
        self._segment, self._index = segment, self._index + 1
        if self._untold:
            _say(f"{name.trace}: recording again, {self._untold} turns were lost")
        self.lost, self._untold = self.lost + self._untold, 0

    def _fail(self, problem: OSError) -> None:
        if self._segment is not None:
            self._segment.abandon()
            self._untold += self._segment.unwritten
            self._segment = None
        if not self._warned:
            self._warned = True
            _say(f"{self._directory}: {problem.strerror}: recording has stopped until there is room")


def main(arguments: list[str]) -> int:
    """Read frames until the loop closes its end. Returns 1 when records were lost."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # the daemon's last words come after these
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))  # whatever the daemon was started with
        os.nice(5)
    directory, flight, segment_bytes, segments = arguments
    scribe = Scribe(Path(directory), int(flight), int(segment_bytes), int(segments))
    reader = FrameReader()
    os.set_blocking(0, False)
    while (piece := _read()) != b"":
        if piece is None:
            time.sleep(NAP_S)
            continue
        for payload in reader.feed(piece):
            scribe.take(payload)
        scribe.flush()
    scribe.close()
    if scribe.lost:
        _say(f"{directory}: {scribe.lost} turns of the loop were not recorded")
    return 1 if scribe.lost else 0


def _read() -> bytes | None:
    """What stands in the pipe, None when nothing does, b"" when nothing will."""
    try:
        return os.read(0, _PIECE)
    except BlockingIOError:
        return None


def _say(text: str) -> None:
    """One line, unless nobody takes what stands on standard error already: recording waits for a disk, not for that."""
    with contextlib.suppress(OSError):
        if select.select([], [sys.stderr], [], 0.0)[1]:
            print(f"recorder: {text}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
