"""MAVLink 2 signing as a command sees it: key and newest timestamp come from files, and the latter goes back."""

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path

from dob_companion.companion import CompanionConfig, Event
from dob_companion.errors import ConfigError
from dob_companion.files import BackgroundWriter
from dob_companion.files.atomic import make_directory
from dob_companion.files.keys import read_key
from dob_companion.files.timestamp import NAME, TimestampKeeper, recover_timestamp
from dob_companion.mavlink import Severity
from dob_companion.mavlink.signing import SigningGate, ticks

REFUSALS_EVERY_S = 10.0
"""Wall time between two lines about refused frames."""


class Signing:
    """A gate whose timestamp is kept on disk. The file is closed with `leaving`."""

    def __init__(
        self,
        key: bytes,
        directory: Path,
        show: Callable[[Event], None],
        complain: Callable[[str], None],
        leaving: ExitStack,
        *,
        datagrams: bool,
    ) -> None:
        self.gate = SigningGate(key, max(recover_timestamp(directory), ticks(time.time())), datagrams=datagrams)
        self._show = show
        self._refused, self._tell_at = 0, 0.0
        writer = BackgroundWriter(directory / NAME, complain)
        self._keeper = TimestampKeeper(leaving.enter_context(writer))
        leaving.callback(self.keep, float("inf"))

    def keep(self, now: float) -> None:
        """Keep the timestamp, now and then."""
        self._keeper.keep(now, self.gate.timestamp)

    def tell(self, now: float) -> None:
        """Tell what was refused, now and then."""
        counters = self.gate.counters
        if counters.refused == self._refused or now < self._tell_at:
            return
        self._refused, self._tell_at = counters.refused, now + REFUSALS_EVERY_S
        counts = ", ".join(f"{count} {name}" for name, count in asdict(counters).items() if name != "admitted")
        self._show(Event(Severity.WARNING, f"signing: refused so far: {counts}"))


def open_signing(
    settings: CompanionConfig,
    show: Callable[[Event], None],
    complain: Callable[[str], None],
    leaving: ExitStack,
    *,
    datagrams: bool,
) -> Signing | None:
    """The signing that is configured, or None. `complain` is called from another thread, about a timestamp that cannot
    be kept. Raises InputError for a key unfit for use, ConfigError without a place
    for timestamps."""
    if settings.signing_key_file is None:
        return None
    if settings.state_directory is None:
        raise ConfigError("signing_key_file needs state_directory: timestamps must go on where they ended")
    key = read_key(Path(settings.signing_key_file))
    make_directory(Path(settings.state_directory))
    return Signing(key, Path(settings.state_directory), show, complain, leaving, datagrams=datagrams)
