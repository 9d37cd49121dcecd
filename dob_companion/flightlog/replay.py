"""A recorded flight once more: the same calls to a companion built anew must give the same bytes.

`Replay` listens to a recording (`files.playback` calls its methods) and compares every message that was said with the
one that is computed now, and every checkpoint with the state reached by computing from the one before.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Protocol

from dob_companion.artifact import DobDesign, loads
from dob_companion.companion.config import CompanionConfig, parse_config
from dob_companion.companion.core import Companion
from dob_companion.errors import InputError
from dob_companion.flightlog.snapshot import SnapshotError, Snapshots, difference, restore
from dob_companion.flightlog.standing import Standing
from dob_companion.mavlink import ComputerLoad, profiles
from dob_companion.mavlink.spoken import Correction, SpokenReader


class Origin(Protocol):
    """What a segment says of the companion: texts of design and configuration, profile, and the kind of its link."""

    @property
    def design(self) -> str:
        """Text of the design.json."""

    @property
    def config(self) -> str:
        """Text of the configuration."""

    @property
    def profile(self) -> str:
        """The profile that was asked for."""

    @property
    def datagrams(self) -> bool:
        """Whether the link delivered whole datagrams."""


def recorded_config(text: str, profile: str) -> CompanionConfig:
    """The configuration of a recorded flight. Raises InputError where this program does not know the profile."""
    if profile not in profiles.NAMES:
        raise InputError(f"the flight was flown with profile {profile!r}, expected {' or '.join(profiles.NAMES)}")
    return replace(parse_config(text, "the recorded configuration"), profile=profile)


class Replay:
    """Counts what was compared; `difference` names the first thing that was not the same, "" while there is none.

    With `expected`, a recording of another design raises InputError. What follows a difference is not compared: it
    follows from it.
    """

    def __init__(self, expected: DobDesign | None = None) -> None:
        self.turns = self.messages = self.corrections = self.checkpoints = self.lost_turns = 0
        self.difference = ""
        self._expected = expected
        self._spoken = SpokenReader()
        self._build: tuple[str, str, str, bool] | None = None
        self._companion: Companion | None = None
        self._due: deque[bytes] = deque()
        self._changes: list[tuple[Any, Any]] = []
        self._changes_told = False
        self._time = 0.0

    def began(self, segment: Origin) -> None:
        """A segment begins."""
        build = (segment.design, segment.config, segment.profile, segment.datagrams)
        if self._build == build:
            return
        self._companion, self._build = None, build
        self._design = loads(segment.design, "the recorded design")
        self._config = recorded_config(segment.config, segment.profile)
        expected = self._expected.sha256 if self._expected else self._design.sha256
        if expected != self._design.sha256:
            raise InputError(f"the flight was flown with design {self._design.sha256[:8]}, not with {expected[:8]}")
        self._snapshots = Snapshots(self._newborn())

    def checkpoint(self, state: Mapping[str, Any]) -> None:
        """The recorded state: where to begin, or a proof that the computed one is the same."""
        if self.difference:
            return
        if self._companion is not None:
            self.checkpoints += 1
            path = difference(state, self._snapshots.take(self._companion))
            if path:
                self._differs(f"state {path} is not what was recorded")
            return
        companion = self._newborn()
        try:
            restore(companion, state)
        except SnapshotError as problem:
            raise InputError(f"the recording does not fit this version of the program: {problem}") from None
        self._companion = companion

    def standing(self, content: Mapping[str, Any]) -> None:
        """What readers of the recording rely on must be true of the state beside it."""
        if self._companion is not None and not self.difference:
            computed = Standing.of(self._companion).as_json()
            self._changes_told = True
            if content != computed:
                self._differs(f"recorded standing {dict(content)}, computed {computed}")

    def changed(self, content: Mapping[str, Any]) -> None:
        """A change of state was recorded."""
        self._changes.append((content.get("state"), content.get("reason")))

    def lost(self, turns: int) -> None:
        """What follows does not continue what came before."""
        self.lost_turns += turns
        self._companion = None
        self._changes.clear()
        self._due.clear()

    def received(self, data: bytes, now: float) -> None:
        """Bytes came from the link."""
        if companion := self._called(now):
            companion.receive(data, now)

    def advanced(self, now: float) -> None:
        """Time has passed."""
        if companion := self._called(now):
            companion.advance(now)

    def closing(self, now: float) -> None:
        """The companion was told to leave."""
        if companion := self._called(now):
            companion.close(now)

    def loaded(self, load: tuple[int, int, int]) -> None:
        """It was told how its computer does."""
        if self._companion:
            self._companion.load = ComputerLoad(*load)

    def said(self, message: bytes) -> None:
        """It answered to the calls before."""
        if self._companion is None or self.difference:
            return
        self.messages += 1
        self.corrections += isinstance(self._spoken.read(message), Correction)
        if not self._due:  # only now: a companion is asked what it has to say when the recorded one was
            self._due.extend(self._companion.bytes_to_send())
        computed = self._due.popleft() if self._due else b""
        if computed != message:
            self._differs(f"recorded {self._words(message)}, computed {self._words(computed)}")

    def turned(self, now: float, took_s: float) -> None:  # noqa: ARG002
        """A turn of the loop is over: all was said, and its events were taken."""
        if self._companion is None or self.difference:
            return
        self._due.extend(self._companion.bytes_to_send())
        if self._due:
            self._differs(f"recorded nothing, computed {self._words(self._due[0])}")
            return
        changes = [each.change for each in self._companion.events() if each.change]
        computed, recorded = [(change.target.name, change.reason) for change in changes], self._changes
        self._changes = []
        if self._changes_told and computed != recorded:
            self._differs(f"recorded changes of state {recorded}, computed {computed}")
            return
        self.turns += 1

    def _newborn(self) -> Companion:
        datagrams = self._build is None or self._build[-1]
        return Companion(self._design, self._config, datagrams=datagrams)

    def _called(self, now: float) -> Companion | None:
        """The companion to call, unless there is none or the comparison is over."""
        self._time = now
        return None if self.difference else self._companion

    def _differs(self, what: str) -> None:
        self.difference = f"turn {self.turns + 1}, t = {self._time:.6f} s: {what}"

    def _words(self, message: bytes) -> str:
        return self._spoken.in_words(message) if message else "nothing"
