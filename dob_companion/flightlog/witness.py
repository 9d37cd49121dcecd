"""Who is told of everything that a companion is told and answers, in order: recorder, log, views, watchdog."""

from collections.abc import Sequence

from dob_companion.companion import Companion, Event, Status
from dob_companion.mavlink import ComputerLoad


class Witness:
    """Hears everything and does nothing; whoever derives from it does what it wants to.

    Called within the loop, so each method returns at once, and changes nothing of the companion. `now` is s of the
    daemon's monotonic clock.

    Whoever builds a companion anew and makes the same calls, `received` to `loaded`, gets the same answers: that is
    what makes a recorded flight repeatable. A new call that changes a companion therefore belongs here.
    """

    watches = False
    """Whether `status` is wanted, ten times a second."""

    def begins(self, companion: Companion, now: float) -> None:
        """A turn of the loop begins: in every turn, several times a second at least."""

    def received(self, data: bytes, now: float) -> None:
        """`Companion.receive` was called."""

    def advanced(self, now: float) -> None:
        """`Companion.advance` was called."""

    def closing(self, now: float) -> None:
        """`Companion.close` was called."""

    def loaded(self, load: ComputerLoad) -> None:
        """`Companion.load` was set."""

    def said(self, messages: Sequence[bytes]) -> None:
        """The companion answered to the calls before; the answers leave when this returns."""

    def event(self, event: Event) -> None:
        """The companion, its link or the loop has something to tell."""

    def status(self, companion: Companion, status: Status) -> None:
        """How things stand."""

    def turned(self, companion: Companion, now: float, took_s: float) -> str:  # noqa: ARG002
        """A turn that woke at `now` is over after `took_s`. Returns what the operator should hear, or ""."""
        return ""
