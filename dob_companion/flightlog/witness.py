"""Who is told of everything that a companion is told and answers, in order: the base of a flight recorder."""

from collections.abc import Sequence

from dob_companion.companion.core import Companion
from dob_companion.mavlink import ComputerLoad


class Witness:
    """Hears everything and does nothing. Called within the loop, so each method returns at once and raises nothing.

    Whoever builds a companion anew and makes the same calls gets the same answers: that is what makes a recorded
    flight repeatable. A new call that changes a companion therefore belongs here.
    """

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

    def turned(self, companion: Companion, now: float, took_s: float) -> str:  # noqa: ARG002
        """A turn that woke at `now` is over after `took_s`. Returns what the operator should hear, or ""."""
        return ""
