"""What the log says while no vehicle is heard: a daemon that waits without a word looks like one that hangs."""

from collections.abc import Callable

from dob_companion.companion import Companion, Event
from dob_companion.flightlog.witness import Witness
from dob_companion.runtime import LinkUrl

FIRST_S, LONGEST_S = 5.0, 600.0
"""The first word comes after 5 s, each further one when as much time again has passed, at most ten minutes."""


class Waiting(Witness):
    """Says how long nobody has been heard, what has come in instead, and what to look for; and of a vehicle that is
    heard, why the observer still gets nothing."""

    def __init__(
        self,
        url: LinkUrl,
        system: int | None,
        show: Callable[[Event], None],
        now: float,
        *,
        makes: tuple[str, ...] = (),
        design: str = "",
    ) -> None:
        self._url = url
        whose = f"{' or '.join(makes)}'s" if makes else "an autopilot's"
        self._wanted = f"{whose} heartbeat" + (f" from system {system}" if system is not None else "")
        self._show = show
        self._since, self._next = now, now + FIRST_S
        self._received = 0
        self._met: float | None = None
        self._told = False
        self._more = (
            f"dob-companion doctor --link {url}"
            + (f" --design {design}" if design else "")
            + " tells more, once this has stopped"
        )

    def received(self, data: bytes, now: float) -> None:  # noqa: ARG002
        """Count what comes in."""
        self._received += len(data)

    def begins(self, companion: Companion, now: float) -> None:
        """Say what is to be said by now."""
        if companion.vehicle is not None:
            self._without_samples(companion, now)
            return
        if now < self._next:
            return
        waited = self._next - self._since
        self._next += min(waited, LONGEST_S)
        status = companion.status()
        more = f"; {self._more}" if waited == FIRST_S else ""
        self._show(Event.info(f"no vehicle for {waited:.0f} s: {self._what(status.bad, status.foreign)}{more}"))

    def _without_samples(self, companion: Companion, now: float) -> None:
        """Says once why a vehicle that is heard does not feed the observer."""
        self._met = now if self._met is None else self._met
        if self._told or now - self._met < FIRST_S:
            return
        self._told = True
        status = companion.status()
        if status.stepped == 0 and status.why:
            self._show(Event.info(f"waiting for gyro and moment: {status.why}; {self._more}"))

    def _what(self, bad: int, foreign: int) -> str:
        received = self._received
        if not received:
            return f"nothing has come in on {self._url}; {self._remedy}"
        if bad > foreign:
            serial = "; is this the port's baud rate?" if self._url.scheme == "serial" else ""
            return f"{received} bytes have come in on {self._url}, hardly any of them MAVLink{serial}"
        return f"{received} bytes have come in on {self._url}, but not {self._wanted}"

    @property
    def _remedy(self) -> str:
        match self._url.scheme:
            case "serial":
                return "does the autopilot speak MAVLink on that port, and at this baud rate?"
            case "tcp":
                return "does anybody listen there?"
            case "udpout":
                return "does the autopilot listen there?"
        return "does the autopilot send there?"
