"""Asking the autopilot for its streams, and watching that they come.

What settles a request is the stream itself, heard at its rate. An acknowledgement does not say which message it is
about, may come twice where links are redundant, or never; so it only ends the waiting for itself, and brings refusals.
"""

from dataclasses import dataclass

from dob_companion.companion.samples import RESTART_US
from dob_companion.mavlink import CommandAck, Input, StreamRequest, Watched
from dob_companion.supervisor.monitors import FULL_RATE

RETRY_S = 1.0
"""Wall time after which an unanswered request makes room for the next one."""

SPACING_S = 0.1
"""Wall time between an acknowledgement and the next request: a second copy of it then answers nothing."""

RENEW_S = 4.5
"""Wall time between two requests for a stream that is missing or too slow: another program may have changed it. As it
is looked at once a second, that is every 5 s."""

WINDOW_S = 1.5
"""Least time over which a stream is counted: two looks, a second apart."""


class StreamRequests:
    """One request at a time, each at most `tries` times. One that is not answered goes to the end of the queue."""

    def __init__(self, tries: float = float("inf")) -> None:
        self._tries = tries
        self._times: dict[int, int] = {}
        self._queue: list[StreamRequest] = []
        self._waiting = False
        self._ask_at = float("-inf")

    def ask(self, request: StreamRequest) -> None:
        """Ask for a stream, unless that is being done."""
        if request not in self._queue:
            self._queue.append(request)
            self._times[request.message] = 0

    def settle(self, request: StreamRequest) -> None:
        """There is nothing to ask for any more: the stream is heard."""
        if request in self._queue:
            self._waiting = self._waiting and request != self._queue[0]
            self._queue.remove(request)

    def due(self, now: float) -> StreamRequest | None:
        """The request to send now, if any."""
        if now < self._ask_at:
            return None
        if self._waiting:
            unanswered = self._queue.pop(0)
            if self._times[unanswered.message] < self._tries:
                self._queue.append(unanswered)
        self._waiting = bool(self._queue)
        if not self._waiting:
            return None
        self._ask_at = now + RETRY_S
        self._times[self._queue[0].message] += 1
        return self._queue[0]

    def answered(self, ack: CommandAck, now: float) -> StreamRequest | None:
        """Take an acknowledgement; returns the request that it answers, None where none is open."""
        if not self._waiting or ack.command != self._queue[0].command:
            return None
        self._waiting, self._ask_at = False, now + SPACING_S
        return self._queue.pop(0)

    @property
    def deadline(self) -> float:
        """When `due` will next have something to say; inf when nothing is asked for."""
        return self._ask_at if self._queue else float("inf")


@dataclass(slots=True)
class _Stream:
    """One wanted stream: when it was asked for, what came since the count began, what the last count said, and whether
    that has been told."""

    request: StreamRequest
    asked_at: float = float("-inf")
    count: int = 0
    newest_us: int = 0
    lacking: bool = False
    told: bool = False


class WantedStreams:
    """Asks for streams, and again for each that is missing or too slow, until it is heard at its rate.

    Times in s. A stream is counted on the clock, ours or the vehicle's, on which less time has passed: a simulation in
    lockstep may stand still, or run ahead.
    """

    def __init__(self, wanted: tuple[StreamRequest, ...]) -> None:
        self._requests = StreamRequests()
        self._streams = {request.brings: _Stream(request) for request in wanted}
        self._since = self._vehicle_since = 0.0

    def start(self, now: float) -> None:
        """Ask for everything, from the first on."""
        for stream in self._streams.values():
            self._ask(stream)
            stream.asked_at, stream.lacking, stream.told = now, False, False
        self._count_anew(now, 0.0)

    def heard(self, what: Input | Watched, stamp_us: int | None = None) -> None:
        """A message has come; a stamp that is not newer than the newest is a copy, and no news."""
        stream = self._streams.get(what)
        if stream is None:
            return
        if stamp_us is not None:
            if stream.newest_us - RESTART_US < stamp_us <= stream.newest_us:
                return
            stream.newest_us = stamp_us
        stream.count += 1

    def judge(self, now: float, vehicle_s: float, *, silent: bool) -> list[str]:
        """Ask again for what is missing and can be asked for; says so once, until it is heard. `silent`: no sample
        tells vehicle time."""
        passed = now - self._since
        if not silent:
            passed = min(passed, vehicle_s - self._vehicle_since)
        if passed >= WINDOW_S:
            for stream in self._streams.values():
                self._judge(stream, passed)
        if passed >= WINDOW_S or passed < 0.0:  # or the vehicle's clock has restarted
            self._count_anew(now, vehicle_s)
        return [said for stream in self._streams.values() if (said := self._renew(stream, now))]

    def due(self, now: float) -> StreamRequest | None:
        """The request to send now, if any."""
        request = self._requests.due(now)
        if request is not None and request.brings is not None:
            self._streams[request.brings].asked_at = now
        return request

    def answered(self, ack: CommandAck, now: float) -> str:
        """Take an acknowledgement; a refusal in words, once until the stream is heard, or ""."""
        request = self._requests.answered(ack, now)
        if request is None or request.brings is None or ack.accepted:
            return ""
        stream = self._streams[request.brings]
        told, stream.told = stream.told, True
        return "" if told else f"{request.name} refused ({ack.result})"

    @property
    def deadline(self) -> float:
        """When `due` will next have something to say."""
        return self._requests.deadline

    def _judge(self, stream: _Stream, passed: float) -> None:
        expected = passed / (1e-6 * stream.request.interval_us)
        least = FULL_RATE * expected - 1.0  # one of the window may be on its way
        stream.lacking = stream.count < (1 if stream.request.unasked else least)
        if not stream.lacking:
            self._requests.settle(stream.request)
            stream.told = False

    def _renew(self, stream: _Stream, now: float) -> str:
        if not stream.lacking or now - stream.asked_at < RENEW_S:
            return ""
        self._ask(stream)
        told, stream.told = stream.told, True
        words = f"{stream.request.name} lacking"
        return "" if told else words if stream.request.unasked else f"{words}, asked again"

    def _ask(self, stream: _Stream) -> None:
        if not stream.request.unasked:
            self._requests.ask(stream.request)

    def _count_anew(self, now: float, vehicle_s: float) -> None:
        self._since, self._vehicle_since = now, vehicle_s
        for stream in self._streams.values():
            stream.count = 0
