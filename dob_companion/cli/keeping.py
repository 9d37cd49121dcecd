"""What a run takes up from the one before and keeps for the next: the operator's settings and the signing timestamp."""

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, replace
from pathlib import Path

from dob_companion.companion import Companion, CompanionConfig, Event
from dob_companion.errors import ConfigError
from dob_companion.files import LatestWriter, SettingsKeeper, recover_settings
from dob_companion.files.keys import read_key
from dob_companion.files.settings import NAME as SETTINGS
from dob_companion.files.timestamp import NAME as TIMESTAMP
from dob_companion.files.timestamp import TimestampKeeper, recover_timestamp
from dob_companion.mavlink import Severity
from dob_companion.mavlink.signing import SigningGate, ticks
from dob_companion.runtime import Link
from dob_companion.runtime.signed import SignedLink

REFUSALS_EVERY_S = 10.0
"""Wall time between two lines about refused frames."""


class Keeping:
    """Recovers at the start; `turn` hands over what is new. Files close with `leaving`.

    `settings` is the configuration with what the operator had set on top of it.
    """

    def __init__(self, settings: CompanionConfig, show: Callable[[Event], None], leaving: ExitStack) -> None:
        self.settings = settings
        self._show = show
        self._leaving = leaving
        self._operator: SettingsKeeper | None = None
        self._gate: SigningGate | None = None
        self._refused, self._tell_at = 0, 0.0
        self._directory = Path(settings.state_directory) if settings.state_directory else None
        if self._directory is not None:
            self._recover(self._directory)

    def signed(self, link: Link, datagrams: bool) -> Link:
        """The link, behind a signing gate when a key is configured. Raises InputError for a key unfit for use."""
        if self.settings.signing_key_file is None:
            return link
        if self._directory is None:
            raise ConfigError("signing_key_file needs state_directory: timestamps must go on where they ended")
        key = read_key(Path(self.settings.signing_key_file))
        newest = max(recover_timestamp(self._directory), ticks(time.time()))
        self._gate = SigningGate(key, newest, datagrams=datagrams)
        self._timestamp = TimestampKeeper(self._writer(self._directory / TIMESTAMP))
        self._leaving.callback(self._tell_refusals, float("inf"), self._gate)
        self._show(Event.info("signing: only messages with our key are taken, and ours are signed"))
        return SignedLink(link, self._gate)

    def turn(self, now: float, companion: Companion) -> None:
        """Called in every turn of the loop; hands over to the writers and waits for nothing."""
        if self._operator is not None:
            self._operator.keep(companion.parameters.written)
        if self._gate is not None:
            self._timestamp.keep(now, self._gate.timestamp)
            self._tell_refusals(now, self._gate)

    def _recover(self, directory: Path) -> None:
        values, warning = recover_settings(directory)
        if warning:
            self._show(Event(Severity.WARNING, warning))
        if values:
            shown = ", ".join(f"{name} {value:g}" for name, value in values.items())
            self._show(Event.info(f"set by the operator: {shown}"))
        self._operator = SettingsKeeper(self._writer(directory / SETTINGS), values)
        self.settings = replace(self.settings, parameters={**self.settings.parameters, **values})

    def _writer(self, path: Path) -> LatestWriter:
        return self._leaving.enter_context(LatestWriter(path, lambda text: self._show(Event(Severity.WARNING, text))))

    def _tell_refusals(self, now: float, gate: SigningGate) -> None:
        counters = gate.counters
        if counters.refused == self._refused or now < self._tell_at:
            return
        self._refused, self._tell_at = counters.refused, now + REFUSALS_EVERY_S
        counts = ", ".join(f"{count} {name}" for name, count in asdict(counters).items() if name != "admitted")
        self._show(Event(Severity.WARNING, f"signing: refused so far: {counts}"))
