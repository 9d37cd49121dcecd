"""The flight recorder as the loop sees it: a few bytes into a pipe each turn, never a wait, never an exception.

What the loop hands over goes to the scribe (`files/scribe.py`), a process of its own. When the pipe is full, turns are
dropped and counted, and recording begins again with a checkpoint.
"""

import contextlib
import errno
import os
import platform
import time
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from dob_companion import __version__
from dob_companion.artifact import DobDesign, dumps
from dob_companion.companion import Companion, Event, Recording, parse_config
from dob_companion.errors import InputError
from dob_companion.files.atomic import make_directory
from dob_companion.files.pipe import ScribePipe
from dob_companion.files.segments import SegmentName, next_flight
from dob_companion.files.trace import SCHEMA, Kind, count_item, frame, item, json_item, time_item
from dob_companion.flightlog.snapshot import Snapshots
from dob_companion.flightlog.standing import Standing
from dob_companion.flightlog.witness import Witness
from dob_companion.mavlink import ComputerLoad, profiles

CHECKPOINT_S = 20.0
"""Time between two checkpoints: how long an interrupted recording may wait until it goes on."""

CHECKPOINT_BYTES = 4 << 20
"""A checkpoint also comes after so much: segments end at checkpoints only, and no flood must make one grow."""

RETRY_S = 1.0
"""Time after which a full pipe is tried again."""

_PATIENCE_S = 3.0
_DEFAULT = Recording()


class FlightRecorder(Witness):
    """Records one companion from now on; the loop calls the methods of a Witness.

    `config_text` is the configuration that the companion was built from, `profile` the one asked for, in place of what
    that says; `mb` and `segments` are those of `Recording`.
    Raises InputError, one line, when the directory cannot be written.
    """

    def __init__(
        self,
        directory: Path,
        companion: Companion,
        design: DobDesign,
        config_text: str = "",
        *,
        now: float,
        datagrams: bool = True,
        mb: float = _DEFAULT.mb,
        segments: int = _DEFAULT.segments,
        profile: str = profiles.AUTO,
    ) -> None:
        config = replace(parse_config(config_text, "configuration"), profile=profile)
        newborn = Companion(design, config, datagrams=datagrams)
        self._snapshots = Snapshots(newborn)
        self.flight = _claim(directory)
        self.lost = 0
        self._interrupted, self._missing = False, 0
        self._items: list[bytes] = []
        self._now: float | None = None
        self._since = 0
        self._due_at = now + CHECKPOINT_S
        self._trouble = ""
        self._pipe = ScribePipe([str(directory), str(self.flight), str(round(1e6 * mb)), str(segments)])
        self._pipe.send(
            frame([json_item(Kind.HEADER, _header(design, config_text, profile, datagrams, self.flight, now))])
        )
        self._pipe.send(self._state_of(companion))

    @property
    def scribe(self) -> int:
        """Process id of the scribe."""
        return self._pipe.pid

    def received(self, data: bytes, now: float) -> None:
        """Bytes came from the link."""
        self._at(now)
        self._items.append(item(Kind.RECEIVED, data))

    def advanced(self, now: float) -> None:
        """Time has passed."""
        self._at(now)
        self._items.append(item(Kind.ADVANCED))

    def closing(self, now: float) -> None:
        """The companion was told to leave."""
        self._at(now)
        self._items.append(item(Kind.CLOSING))

    def loaded(self, load: ComputerLoad) -> None:
        """The companion was told how this computer does."""
        self._items.append(json_item(Kind.LOAD, [load.uptime_ms, load.ram_usage_mib, load.ram_total_mib]))

    def event(self, event: Event) -> None:
        """A change of state is kept as one; other events are words that were said as well, or of no flight."""
        if event.change:
            content = {"state": event.change.target.name, "reason": event.change.reason}
            self._items.append(json_item(Kind.CHANGED, content))

    def said(self, messages: Sequence[bytes]) -> None:
        """The companion answers: hand it over before the answers leave, so that none is unknown after a crash."""
        self._items.extend([item(Kind.SAID, message) for message in messages])
        self._hand_over()

    def turned(self, companion: Companion, now: float, took_s: float) -> str:
        """A turn of the loop is over, `took_s` after it woke. Returns a new trouble in words, or ""."""
        self._items.append(time_item(Kind.TOOK, took_s))
        self._now = None
        self._hand_over()
        if self._interrupted:
            self._lose(now)
        if not self._pipe.broken and (now >= self._due_at or (self._since > CHECKPOINT_BYTES and not self._missing)):
            self._checkpoint(companion, now)
        trouble, self._trouble = self._trouble, ""
        return trouble

    def close(self) -> None:
        """Hand over what is left and let the scribe end. Waits for a few seconds at most."""
        if self._missing:
            self._pipe.send(frame([count_item(self._missing)]))
        self._pipe.close(_PATIENCE_S)

    def _at(self, now: float) -> None:
        if now != self._now:
            self._now = now
            self._items.append(time_item(Kind.TIME, now))

    def _hand_over(self) -> None:
        if not self._interrupted:
            data = frame(self._items)
            self._since += len(data)
            self._interrupted = not self._pipe.send(data)
        self._items.clear()

    def _lose(self, now: float) -> None:
        if not self.lost:
            why = "the recorder's process has ended" if self._pipe.broken else "the disk does not keep up"
            self._trouble = f"recorder: {why}, turns are lost"
        if not self._missing:
            self._due_at = now + RETRY_S
        self._missing += 1
        self.lost += 1

    def _state_of(self, companion: Companion) -> bytes:
        checkpoint = json_item(Kind.CHECKPOINT, self._snapshots.take(companion))
        return frame([checkpoint, json_item(Kind.STANDING, Standing.of(companion).as_json())])

    def _checkpoint(self, companion: Companion, now: float) -> None:
        """Costs a millisecond or two, after the turn's answers have left."""
        self._due_at, self._since = now + (RETRY_S if self._missing else CHECKPOINT_S), 0
        try:
            checkpoint = self._state_of(companion)
        except Exception as problem:  # a recorder that errs may cost the record, never the flight
            self._trouble = f"recorder: no checkpoint: {problem}"
            return
        lost = frame([count_item(self._missing)]) if self._missing else b""
        if self._pipe.send(lost + checkpoint):
            self._interrupted, self._missing, self._due_at = False, 0, now + CHECKPOINT_S


def _header(
    design: DobDesign, config_text: str, profile: str, datagrams: bool, flight: int, now: float
) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "generator": f"dob-companion {__version__}",
        "machine": f"{platform.machine()}, Python {platform.python_version()}, numpy {np.__version__}",
        "started": datetime.now(UTC).isoformat(timespec="milliseconds"),
        "unix_offset": time.time() - now,
        "flight": flight,
        "datagrams": datagrams,
        "config": config_text,
        "profile": profile,
        "design": dumps(design)[0],
    }


def _claim(directory: Path) -> int:
    """The number of this flight, reserved by its first file. A disk that is full now may have room later."""
    make_directory(directory)
    while True:
        try:
            name = SegmentName(directory, next_flight(directory), 0)
            os.close(os.open(name.trace, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644))
        except FileExistsError:  # another daemon was quicker
            continue
        except OSError as problem:
            if problem.errno in (errno.ENOSPC, errno.EDQUOT):
                with contextlib.suppress(OSError):
                    return next_flight(directory)
            raise InputError(f"{directory}: cannot be recorded to: {problem.strerror}") from None
        return name.flight
