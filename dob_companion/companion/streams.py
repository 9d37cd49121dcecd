"""Asking the autopilot for its streams: request, wait for the acknowledgement, ask again when they run dry."""

from dob_companion.mavlink import CommandAck, StreamRequest

RETRY_S = 1.0
"""Wall time after which an unanswered request is repeated."""

RENEW_S = 5.0
"""Wall time between renewed requests while a stream is too slow: another program may have changed it."""


class StreamRequests:
    """One request at a time, because an acknowledgement does not say which message it is about."""

    def __init__(self, requests: tuple[StreamRequest, ...]) -> None:
        self._all = requests
        self._open: list[StreamRequest] = []
        self._ask_at = float("inf")
        self._renew_at = 0.0

    def start(self, now: float) -> None:
        """Ask for everything, from the first on."""
        self._open = list(self._all)
        self._ask_at, self._renew_at = now, now + RENEW_S

    def renew(self, now: float) -> None:
        """A stream is too slow: ask for everything again, but not more often than every RENEW_S."""
        if not self._open and now >= self._renew_at:
            self.start(now)

    def due(self, now: float) -> StreamRequest | None:
        """The request to send now, if any."""
        if not self._open or now < self._ask_at:
            return None
        self._ask_at = now + RETRY_S
        return self._open[0]

    def answered(self, ack: CommandAck, now: float) -> StreamRequest | None:
        """Take an acknowledgement; returns the request that it settles."""
        if not self._open or ack.command != self._open[0].command:
            return None
        self._ask_at = now
        return self._open.pop(0)

    def give_up(self, now: float) -> None:
        """Nobody answers the open request: go on to the next."""
        self._open = self._open[1:]
        self._ask_at = now

    @property
    def deadline(self) -> float:
        """When `due` will next have something to say."""
        return self._ask_at if self._open else float("inf")
