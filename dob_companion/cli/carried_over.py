"""What a run takes up from the one before and keeps for the next: the operator's settings and the signing timestamp."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from queue import SimpleQueue

from dob_companion.cli.signing import Signing, open_signing
from dob_companion.companion import Companion, CompanionConfig, Event
from dob_companion.files import BackgroundWriter, ParameterKeeper, recover_parameters
from dob_companion.files.parameter_keeper import NAME as SETTINGS
from dob_companion.flightlog.witness import Witness
from dob_companion.mavlink import Severity
from dob_companion.runtime import Link
from dob_companion.runtime.signed import SignedLink


class CarriedOver(Witness):
    """Recovers at the start; each turn hands over what is new. Files close with `leaving`.

    `settings` is the configuration with what the operator had set on top of it.
    """

    def __init__(self, settings: CompanionConfig, show: Callable[[Event], None], leaving: ExitStack) -> None:
        self.settings = settings
        self._show = show
        self._leaving = leaving
        self._complaints: SimpleQueue[str] = SimpleQueue()  # of the writers' threads, said by the loop
        leaving.callback(self._tell)
        self._operator: ParameterKeeper | None = None
        self._signing: Signing | None = None
        if settings.state_directory is not None:
            self._recover(Path(settings.state_directory))

    def signed(self, link: Link, datagrams: bool) -> Link:
        """The link, behind a signing gate when a key is configured. Raises InputError for a key unfit for use."""
        self._signing = open_signing(
            self.settings, self._show, self._complaints.put, self._leaving, datagrams=datagrams
        )
        if self._signing is None:
            return link
        self._leaving.callback(self._signing.tell, float("inf"))
        self._show(Event.info("signing: only messages with our key are taken, and ours are signed"))
        return SignedLink(link, self._signing.gate)

    def begins(self, companion: Companion, now: float) -> None:
        """Hand over to the writers; wait for nothing."""
        if self._operator is not None:
            self._operator.keep(companion.parameters.written)
        if self._signing is not None:
            self._signing.keep(now)
            self._signing.tell(now)
        self._tell()

    def _tell(self) -> None:
        while not self._complaints.empty():
            self._show(Event(Severity.WARNING, self._complaints.get()))

    def _recover(self, directory: Path) -> None:
        values, warning = recover_parameters(directory)
        if warning:
            self._show(Event(Severity.WARNING, warning))
        if values:
            shown = ", ".join(f"{name} {value:g}" for name, value in values.items())
            self._show(Event.info(f"set by the operator: {shown}"))
        writer = BackgroundWriter(directory / SETTINGS, self._complaints.put)
        self._operator = ParameterKeeper(self._leaving.enter_context(writer), values)
        self.settings = replace(self.settings, parameters={**self.settings.parameters, **values})
