"""The script of a flight: a state machine over samples and over what the outside does. Pure.

::

    WAIT_ARM ─► WAIT_TAKEOFF ─► CLIMB ─► HOVER                               without windows: until stopped
                                  └────► OFF ─► WAIT_OBSERVER ─► SETTLE ─► ON ─► COMPLETE

OFF and ON are the two segments: each starts the sequences of disturbance, noise, wind and events afresh and flies a
lead, which is left out, and a window. SETTLE is still air with every event undone, so that ON begins from rest as OFF
did. Without windows, wind and events begin once with HOVER.

An awaited event is pinned to a sample: in lockstep the clock stands in a WAIT phase (`Script.awaiting`), in real time
the flight goes on through it.
"""

from enum import Enum

from sitl.autopilot.vehicle import Sample, Vehicle
from sitl.constants import DT_US
from sitl.errors import FlightFailedError
from sitl.log import NO_WINDOW, OFF_WINDOW, ON_WINDOW
from sitl.scenario.spec import Scenario
from sitl.weather.disturbance import CALM, SEGMENT

CLOSE_M, SLOW_M_S, STEADY_SAMPLES = 0.1, 0.1, 125
"""Hover is reached when altitude and climb rate stay this near the target for half a second. A guess."""


class Phase(Enum):
    """Where the flight is."""

    WAIT_ARM = "arm"
    WAIT_TAKEOFF = "takeoff"
    CLIMB = "climb"
    HOVER = "hover"
    OFF = "off"
    WAIT_OBSERVER = "DOB_ENABLE=1"
    SETTLE = "settle"
    ON = "on"
    COMPLETE = "complete"


_WAITING = (Phase.WAIT_ARM, Phase.WAIT_TAKEOFF, Phase.WAIT_OBSERVER)
_AIRBORNE = (Phase.HOVER, Phase.OFF, Phase.WAIT_OBSERVER, Phase.SETTLE, Phase.ON)


class Script:
    """Leads one vehicle through one scenario.

    After each sample call `after_sample`; the notices it returns are for people. `stream`, when not None, is the
    weather stream that begins with the next sample; whoever begins it sets it back to None.
    """

    def __init__(self, scenario: Scenario, vehicle: Vehicle, await_arming: bool) -> None:
        self._scenario, self._vehicle, self._await_arming = scenario, vehicle, await_arming
        self._lead = self._length = self._settle = 0
        if scenario.windows:
            rate_hz = 1e6 / DT_US
            self._lead = round(scenario.windows.lead_s * rate_hz)
            self._length = round(scenario.windows.length_s * rate_hz)
            self._settle = round(scenario.windows.settle_s * rate_hz)
        self._done = 0  # samples of the running phase
        self._steady = 0
        self._observer_on = False
        self.phase = Phase.WAIT_ARM
        self.stream: int | None = None

    @property
    def awaiting(self) -> str | None:
        """The event waited for from outside, None when there is none."""
        return self.phase.value if self.phase in _WAITING else None

    @property
    def window(self) -> int:
        """Window of the next sample: 0 none, 1 observer off, 2 observer on."""
        if self.phase not in (Phase.OFF, Phase.ON) or self._done < self._lead:
            return NO_WINDOW
        return OFF_WINDOW if self.phase is Phase.OFF else ON_WINDOW

    def observer_reported(self, enabled: bool) -> None:
        """The companion told its DOB_ENABLE. Raises FlightFailedError when that spoils the comparison."""
        self._observer_on = enabled
        if enabled and self.phase is Phase.OFF:
            raise FlightFailedError("DOB_ENABLE became 1 before it was asked for; expected 0 in the window off")
        if not enabled and self.phase in (Phase.SETTLE, Phase.ON):
            raise FlightFailedError("DOB_ENABLE became 0; expected 1 to the end of the window on")
        if enabled and self.phase is Phase.WAIT_OBSERVER:
            self._begin(Phase.SETTLE, CALM)
            self._end_settling()

    def poll(self) -> None:
        """Take note of the pilot's commands, which may come while the clock stands."""
        vehicle = self._vehicle
        if self.phase is Phase.WAIT_ARM:
            if not self._await_arming:
                vehicle.arm()
            if vehicle.armed:
                self.phase = Phase.WAIT_TAKEOFF
        if self.phase is Phase.WAIT_TAKEOFF:
            if not self._await_arming and vehicle.target_altitude is None:
                vehicle.take_off(self._scenario.hover_altitude)
            if not vehicle.armed:
                self.phase = Phase.WAIT_ARM
            elif vehicle.target_altitude is not None:
                self.phase = Phase.CLIMB

    def after_sample(self, sample: Sample) -> list[str]:
        """Move on after `sample` was flown; returns notices. Raises FlightFailedError."""
        self.poll()
        if self.phase is Phase.CLIMB:
            return self._climb()
        if self.phase in _AIRBORNE and not self._vehicle.flying:
            if self.phase is Phase.HOVER:  # landed as told; from now on the pilot decides
                self.phase, self._await_arming = Phase.WAIT_ARM, True
                return ["landed"]
            raise FlightFailedError("the vehicle came down before the flight was complete")
        self._done += 1
        if self.phase is Phase.SETTLE:
            self._end_settling()
        elif self.phase in (Phase.OFF, Phase.ON):
            return self._fly_segment(sample)
        return []

    def _climb(self) -> list[str]:
        frame, target = self._vehicle.airframe, self._vehicle.target_altitude
        if target is None:
            self.phase = Phase.WAIT_ARM
            return []
        near = abs(frame.altitude - target) < CLOSE_M and abs(frame.climb) < SLOW_M_S
        self._steady = self._steady + 1 if near else 0
        if self._steady < STEADY_SAMPLES:
            return []
        if not self._length:
            self.phase = Phase.HOVER
            if self._scenario.eventful:
                self._begin(Phase.HOVER, SEGMENT)
            return ["hover reached"]
        if self._observer_on:
            raise FlightFailedError("DOB_ENABLE is already 1; expected 0 until it is asked for")
        self._begin(Phase.OFF, SEGMENT)
        return ["hover reached"]

    def _begin(self, phase: Phase, stream: int) -> None:
        self.phase, self._done, self.stream = phase, 0, stream

    def _end_settling(self) -> None:
        if self._done >= self._settle:
            self._begin(Phase.ON, SEGMENT)

    def _fly_segment(self, sample: Sample) -> list[str]:
        if self.phase is Phase.OFF and any(sample.correction):
            raise FlightFailedError("a correction acts in the window off; expected exact zeros")
        if self._done == self._lead:
            return ["window off" if self.phase is Phase.OFF else "window on"]
        if self._done == self._lead + self._length:
            self.phase = Phase.WAIT_OBSERVER if self.phase is Phase.OFF else Phase.COMPLETE
        return []
