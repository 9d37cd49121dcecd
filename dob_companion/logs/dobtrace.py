"""Our own recordings (docs/recording.md): a segment, or the newest flight of a directory of them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dob_companion.files.playback import Header, play
from dob_companion.files.segments import traces_at
from dob_companion.files.tlog import Splitter
from dob_companion.flightlog.replay import recorded_config
from dob_companion.identification.record import Record
from dob_companion.logs.link import Heard, records_of
from dob_companion.mavlink.axes import IN_HOVER


class _Ear:
    """Keeps the frames that came from the link; the companion's own doings say nothing of the aircraft."""

    def __init__(self) -> None:
        self.heard: list[Heard] = []
        self.missing = 0
        self.axes = IN_HOVER
        self._splitter = Splitter(datagrams=True)

    def began(self, header: Header) -> None:
        self._splitter = Splitter(datagrams=header.datagrams)
        self.axes = recorded_config(header.config, header.profile).axes

    def received(self, data: bytes, now: float) -> None:
        self.heard += [Heard(now, frame) for frame in self._splitter.frames(data)]

    def lost(self, turns: int) -> None:
        self.missing += max(turns, 1)

    def checkpoint(self, state: Mapping[str, Any]) -> None: ...

    def standing(self, content: Mapping[str, Any]) -> None: ...

    def changed(self, content: Mapping[str, Any]) -> None: ...

    def advanced(self, now: float) -> None: ...

    def closing(self, now: float) -> None: ...

    def loaded(self, load: tuple[int, int, int]) -> None: ...

    def said(self, message: bytes) -> None: ...

    def turned(self, now: float, took_s: float) -> None: ...


def read_dobtrace(path: Path) -> tuple[Record, ...]:
    """The records of the vehicle that is heard first. Raises InputError, one line."""
    ear, said = _Ear(), []
    for segment in traces_at(path):
        ending = play(segment, ear)
        if ending.damage:
            said.append(f"{segment.name}: damaged, what stands before was read: {ending.damage}")
        elif ending.torn:
            said.append(f"{segment.name}: ends in the middle of a write: what is whole was read")
    if ear.missing:
        said.append(f"the recorder left out {ear.missing} turns of its loop, or more")
    return records_of(lambda: iter(ear.heard), str(path), said, ear.axes)
