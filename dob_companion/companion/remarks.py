"""What is said of a loop besides its changes of state: what it waits for, on whose clocks, what its link costs."""

from collections.abc import Iterator

from dob_companion.companion.clocks import seconds
from dob_companion.companion.loop import Loop
from dob_companion.companion.waiting import Waiting
from dob_companion.mavlink import Severity
from dob_companion.supervisor import State

Remark = tuple[Severity, str]


class Remarks:
    """Each of them once, until what it tells of is over. Times in s."""

    def __init__(self) -> None:
        self._waiting, self._shortfall = Waiting(), Waiting()
        self._two_clocks = False

    def changed(self, reason: str) -> None:
        """A change of state was told with this reason."""
        self._waiting.said(reason)

    def each_second(self, loop: Loop, now: float) -> Iterator[Remark]:
        """What has stood for long enough at `now`."""
        state = loop.state
        if state in (State.WAITING, State.TRACKING):
            if why := self._waiting.news(loop.why, now):
                yield Severity.NOTICE, f"DOB {state.name}: {why}"
        elif state is not State.RAMP_OUT:  # whose reason has just been said
            self._waiting.over()
        if state is State.ACTIVE:
            if short := self._shortfall.news(loop.shortfall, now):
                yield Severity.NOTICE, f"DOB: {short}"
        elif state is State.DISABLED:
            self._shortfall.over()

    def clocks(self, offset: float | None) -> Iterator[Remark]:
        """Once on the way in and once on the way out: two clocks stand between a right vehicle and injecting."""
        if (offset is not None) == self._two_clocks:
            return
        self._two_clocks = offset is not None
        if offset is None:
            yield Severity.NOTICE, "DOB: gyro and moments on one clock"
        else:
            yield Severity.WARNING, f"DOB: gyro and moments on two clocks: {seconds(offset)}"
