"""The supervisor: one table that says when a correction may be injected.

The table answers one question, at every gyro sample: given where we are and what is true now, where do we go?
Each row lists exits in the order in which they are tried, **the dangerous one first**: a fault beats the operator,
the operator beats the data, and only when nothing speaks against it does a row move towards injecting.

* A correction leaves the aircraft only through RAMP_OUT, so that it fades and never steps. RAMP_OUT always runs to its
  end; it never turns back into RAMP_IN, because what is being faded may be an old, held value.
  (One exception outside this table: a non-finite value is zeroed at once, see `fade`.)
* FAULT is latched. Only the operator's own "off" leaves it, so a fault cannot flicker an aircraft.
* The observer runs whenever the data are good, also while DISABLED: off means that nothing is injected, not that
  nothing is known. Enabling then takes effect within a few samples.

How conditions are found is not decided here (`monitors`, and the companion's `samples`), nor is what a state does
(`fade`). `docs/supervisor.md` is printed from this table.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum


class State(IntEnum):
    """DOB_STATE, numbered as on the wire."""

    DISABLED = 0
    WAITING = 1
    TRACKING = 2
    RAMP_IN = 3
    ACTIVE = 4
    RAMP_OUT = 5
    FAULT = 6

    @property
    def injecting(self) -> bool:
        """Whether a correction may differ from exactly zero in this state."""
        return self in (State.RAMP_IN, State.ACTIVE, State.RAMP_OUT)


@dataclass(frozen=True, slots=True, kw_only=True)
class Conditions:
    """What is true at this sample.

    wish       the operator's DOB_ENABLE
    fault      a fault is latched
    data       samples are fresh, contiguous and finite, and the observer has settled on them
    link       rate and delay are within what the design was certified for
    flight     armed, in the air, in multicopter mode, alone on the link, not killed
    model      axes and signs are right and the moment has authority left
    faded_in   the fade f is exactly 1
    faded_out  the fade f is exactly 0
    why        the reason for whatever speaks against injecting, in words; "" when nothing does
    """

    wish: bool
    fault: bool
    data: bool
    link: bool
    flight: bool
    model: bool
    faded_in: bool
    faded_out: bool
    why: str = ""


@dataclass(frozen=True, slots=True)
class Exit:
    """One way out of a state: taken when `when` holds; `reason` is reported (`{why}` is filled in)."""

    when: str
    test: Callable[[Conditions], bool]
    to: State
    reason: str


_FAULT = Exit("fault", lambda c: c.fault, State.FAULT, "{why}")
_OFF = Exit("not wish", lambda c: not c.wish, State.DISABLED, "switched off")
_FADE = (
    Exit("fault", lambda c: c.fault, State.RAMP_OUT, "{why}"),
    Exit("not wish", lambda c: not c.wish, State.RAMP_OUT, "switched off"),
    Exit("not data", lambda c: not c.data, State.RAMP_OUT, "{why}"),
    Exit("not link", lambda c: not c.link, State.RAMP_OUT, "{why}"),
    Exit("not flight", lambda c: not c.flight, State.RAMP_OUT, "{why}"),
    Exit("not model", lambda c: not c.model, State.RAMP_OUT, "{why}"),
)

TABLE: dict[State, tuple[Exit, ...]] = {
    State.DISABLED: (Exit("wish", lambda c: c.wish, State.WAITING, "switched on"),),
    State.WAITING: (
        _FAULT,
        _OFF,
        Exit("data", lambda c: c.data, State.TRACKING, "data are good"),
    ),
    State.TRACKING: (
        _FAULT,
        _OFF,
        Exit("not data", lambda c: not c.data, State.WAITING, "{why}"),
        Exit("link, flight, model", lambda c: c.link and c.flight and c.model, State.RAMP_IN, "all is well"),
    ),
    State.RAMP_IN: (*_FADE, Exit("faded in", lambda c: c.faded_in, State.ACTIVE, "faded in")),
    State.ACTIVE: _FADE,
    State.RAMP_OUT: (
        Exit("faded out, fault", lambda c: c.faded_out and c.fault, State.FAULT, "{why}"),
        Exit("faded out, not wish", lambda c: c.faded_out and not c.wish, State.DISABLED, "faded out"),
        Exit("faded out", lambda c: c.faded_out, State.WAITING, "faded out"),
    ),
    State.FAULT: (Exit("not wish", lambda c: not c.wish, State.DISABLED, "fault cleared"),),
}


@dataclass(frozen=True, slots=True)
class Transition:
    """A change of state and its reason in words."""

    source: State
    target: State
    reason: str


class Supervisor:
    """Holds the state; moves by at most one row of the table a call."""

    __slots__ = ("state",)

    def __init__(self) -> None:
        self.state = State.DISABLED

    def judge(self, conditions: Conditions) -> Transition | None:
        """Apply the table once. Returns the transition made, or None."""
        for way in TABLE[self.state]:
            if way.test(conditions):
                change = Transition(self.state, way.to, way.reason.format(why=conditions.why or way.when))
                self.state = way.to
                return change
        return None
