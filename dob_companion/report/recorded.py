"""A recorded flight as arrays: read from the messages that were exchanged, so that it needs no companion.

`FlightReader` listens to a recording (the calls of `files.playback`); `flight` then gives the values of the page.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from dob_companion.companion import PARAMETERS, Parameters, parse_config
from dob_companion.companion.samples import RESTART_US
from dob_companion.errors import InputError
from dob_companion.flightlog.flown import Change, FlightClock, Setting
from dob_companion.mavlink import AppliedMoment, Codec, GyroSample, Heartbeat, profiles
from dob_companion.mavlink.spoken import Correction, SpokenReader, Telemetry, Text, Value
from dob_companion.supervisor import State

Array = NDArray[np.float64]

THRUST_FLOOR = 0.05
"""Thrust, 0…1, from which an aircraft counts as flying in the comparison: on the ground every gyro is quiet."""


@dataclass(frozen=True, slots=True, eq=False)
class RecordedFlight:
    """Times in s of flight time (see FlightClock); hover axes in the order roll, pitch, yaw.

    A sample that came twice or late counts once or not at all, as in flight.

    started, machine, generator   what the recording says of itself
    design                        sha256 of the design that flew
    time, stamp_us       (N,)     of each gyro sample; `time` goes on where the vehicle's clock restarts
    ended                         when the recording ends: perhaps long after the last sample
    restarts                      when the vehicle's clock began anew
    gyro                 (N, 3)   y_n, rad/s
    state                (N,)     DOB_STATE when it came in
    flying               (N,)     the vehicle reported thrust
    correction           (N, 3)   the answer, normalized torque; NaN where there was none
    told, d_hat, rate_hz (M,), (M, 3), (M,)   telemetry: its time, estimate, measured rate
    ages                 (K,)     age of the correction in the applied moment, samples; NaN where unknown
    took                 (T,)     wall time of each turn of the loop, s
    changes                       of state, in order
    settings                      the parameters: at the begin, and each change
    lost                          turns of the loop that are not in the recording
    """

    started: str
    machine: str
    generator: str
    design: str
    time: Array
    stamp_us: NDArray[np.int64]
    ended: float
    restarts: tuple[float, ...]
    gyro: Array
    state: NDArray[np.int8]
    flying: NDArray[np.bool_]
    correction: Array
    told: Array
    d_hat: Array
    rate_hz: Array
    ages: Array
    took: Array
    changes: tuple[Change, ...]
    settings: tuple[Setting, ...]
    lost: int

    @property
    def seconds(self) -> float:
        """From the first gyro sample to the end of the recording."""
        return self.ended


class Origin(Protocol):
    """What a segment says of itself."""

    @property
    def started(self) -> str:
        """RFC 3339 time."""

    @property
    def machine(self) -> str:
        """Computer and versions."""

    @property
    def generator(self) -> str:
        """The program that recorded."""

    @property
    def design(self) -> str:
        """Text of the design.json."""

    @property
    def profile(self) -> str:
        """The profile that was asked for."""

    @property
    def config(self) -> str:
        """Text of the configuration."""

    @property
    def datagrams(self) -> bool:
        """Whether the link delivered whole datagrams."""


class FlightReader:
    """Collects what a recorded flight says, segment by segment."""

    def __init__(self) -> None:
        self._first: Origin | None = None
        self._codec, self._asked_profile = Codec(), profiles.AUTO
        self._spoken = SpokenReader()
        self._state = State.DISABLED
        self._thrust = 0.0
        self._now = 0.0
        self._gyro: list[tuple[float, int, tuple[float, float, float], int, bool]] = []
        self._newest_us: int | None = None
        self._row_of: dict[int, int] = {}
        self._answers: dict[int, tuple[float, float, float]] = {}
        self._telemetry: list[tuple[float, tuple[float, float, float], float]] = []
        self._ages: list[float] = []
        self._took: list[float] = []
        self._changes: list[tuple[float, State, str]] = []
        self._values: dict[str, float] = {}
        self._at_start: dict[str, float] | None = None
        self._settings: list[tuple[float, str, float]] = []
        self._lost = 0

    def began(self, segment: Origin) -> None:
        """A segment begins."""
        if self._first is None:
            self._first = segment
            at_start = Parameters(parse_config(segment.config, "the recorded configuration").parameters)
            for spec in PARAMETERS:
                self._set(spec.name, at_start[spec.name])
        profile = profiles.at_first(segment.profile) if self._codec.system is None else self._codec.profile
        self._asked_profile = segment.profile
        self._codec = Codec(self._codec.system, profile=profile, datagrams=segment.datagrams)

    def checkpoint(self, state: Mapping[str, Any]) -> None:
        """The recorded state tells which vehicle is obeyed and where the supervisor stands."""
        self._codec.system = state.get("_codec.system", self._codec.system)
        flown = state.get("_codec.profile")
        if flown is not None:
            self._codec.profile = profiles.named(flown["Profile"])
        named = state.get("loop.supervisor.state", {"enum": ["", "", "DISABLED"]})
        self._state = State[named["enum"][2]]
        for name, value in state.get("parameters._values", {"dict": []})["dict"]:
            self._set(name, value)

    def lost(self, turns: int) -> None:
        """So many turns are missing."""
        self._lost += turns

    def received(self, data: bytes, now: float) -> None:
        """Bytes came from the link."""
        self._goes_on(now)
        for fact in self._codec.facts(data):
            match fact:
                case GyroSample():
                    self._sample(fact, now)
                case AppliedMoment():
                    self._thrust = fact.thrust
                    self._ages.append(fact.age_samples if fact.age_samples >= 0.0 else np.nan)
                case Heartbeat() if self._codec.system is None and fact.make:
                    profile = profiles.choose(self._asked_profile, fact.make)
                    if profile is not None:
                        self._codec.system, self._codec.profile = fact.system, profile

    def said(self, message: bytes) -> None:
        """The companion answered."""
        match self._spoken.read(message):
            case Correction(stamp_us, moment):
                row = self._row_of.get(stamp_us)
                if row is not None:  # a repeat is answered like the first one, and so the first answer is the one
                    self._answers.setdefault(row, moment)
            case Telemetry() as told:
                self._telemetry.append((self._now, told.d_hat, told.rate_hz))
            case Text(_, text):
                self._note(text)
            case Value(name, value):
                self._set(name, value)

    def advanced(self, now: float) -> None:
        """Time has passed."""
        self._goes_on(now)

    def closing(self, now: float) -> None:
        """The companion was told to leave."""
        self._goes_on(now)

    def loaded(self, load: tuple[int, int, int]) -> None:
        """How the computer does is not part of the page."""

    def turned(self, now: float, took_s: float) -> None:
        """A turn of the loop is over."""
        self._goes_on(now)
        self._took.append(took_s)

    def flight(self, source: str) -> RecordedFlight:
        """The flight read. Raises InputError, one line, when it holds too little to show."""
        if self._first is None or len(self._gyro) < 2:
            raise InputError(f"{source}: holds no gyro samples of a vehicle, so there is nothing to report")
        came, stamps, rates, states, flying = zip(*self._gyro, strict=True)
        stamp_us = np.array(stamps, dtype=np.int64)
        clock = FlightClock(came, stamp_us)
        missing = (np.nan,) * 3
        told = self._telemetry or [(came[0], missing, np.nan)]
        return RecordedFlight(
            self._first.started,
            self._first.machine,
            self._first.generator,
            str(json.loads(self._first.design).get("sha256", "")),
            clock.time,
            stamp_us,
            float(max(clock.at(self._now), clock.time[-1])),
            clock.restarts,
            np.array(rates),
            np.array(states, dtype=np.int8),
            np.array(flying),
            np.array([self._answers.get(row, missing) for row in range(len(stamps))]),
            clock.at([at for at, _, _ in told]),
            np.array([d_hat for _, d_hat, _ in told]),
            np.array([rate for _, _, rate in told]),
            np.array(self._ages, dtype=np.float64),
            np.array(self._took, dtype=np.float64),
            tuple(Change(float(clock.at(at)), state, why) for at, state, why in self._changes),
            (
                *(Setting(-np.inf, name, value) for name, value in (self._at_start or {}).items()),
                *(Setting(float(clock.at(at)), name, value) for at, name, value in self._settings),
            ),
            self._lost,
        )

    def _sample(self, sample: GyroSample, now: float) -> None:
        """A stamp that is not newer is a repeat or late, unless it is so much older that the clock began anew."""
        stamp, newest = sample.stamp_us, self._newest_us
        if newest is not None and newest - RESTART_US < stamp <= newest:
            return
        if newest is not None and stamp < newest:
            self._row_of.clear()  # stamps of the boot before mean nothing any more
        self._newest_us, self._row_of[stamp] = stamp, len(self._gyro)
        self._gyro.append((now, stamp, sample.rates, self._state, self._thrust >= THRUST_FLOOR))

    def _goes_on(self, now: float) -> None:
        self._now = now
        if self._at_start is None:
            self._at_start = dict(self._values)

    def _set(self, name: str, value: float) -> None:
        if name == "DOB_STATE" or self._values.get(name) == value:
            return
        self._values[name] = value
        if self._at_start is not None:
            self._settings.append((self._now, name, value))

    def _note(self, text: str) -> None:
        """A text like `DOB ACTIVE: faded in` is a change of state."""
        head, _, reason = text.partition(": ")
        name = head.removeprefix("DOB ")
        if head.startswith("DOB ") and name in State.__members__:
            self._state = State[name]
            self._changes.append((self._now, self._state, reason))
