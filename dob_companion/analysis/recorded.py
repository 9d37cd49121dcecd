"""A recorded flight as arrays: read from the messages that were exchanged, so that it needs no companion.

`FlightReader` listens to a recording (the calls of `files.playback`); `flight` then gives its values. Which vehicle is
obeyed, where the supervisor stands and the parameters it takes from what the recording says of them at its checkpoints
(`flightlog.standing`), and changes of state as they were recorded.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from dob_companion.companion.obeyed import Obeyed
from dob_companion.companion.samples import RESTART_US
from dob_companion.errors import InputError
from dob_companion.flightlog.flown import Change, FlightClock, Setting
from dob_companion.flightlog.replay import recorded_config
from dob_companion.flightlog.standing import Standing, reason_given, state_named
from dob_companion.mavlink import AppliedMoment, Codec, GyroSample, Heartbeat, profiles
from dob_companion.mavlink.axes import IN_HOVER
from dob_companion.mavlink.spoken import Correction, SpokenReader, Telemetry, Value
from dob_companion.supervisor import RegimeLimits, State

Array = NDArray[np.float64]

FLYING = RegimeLimits().throttle_floor
"""Thrust, 0…1, from which an aircraft counts as flying in the comparison: on the ground every gyro is quiet."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
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
        self._obeyed = Obeyed(None, profiles.AUTO, 0.0)
        self._codec, self._axes = Codec(), IN_HOVER
        self._stood = False
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
        config = recorded_config(segment.config, segment.profile)
        self._obeyed = Obeyed(config.system, segment.profile, self._now)
        self._codec = Codec(profile=self._obeyed.profile, datagrams=segment.datagrams, axes=config.axes)
        self._axes = config.axes
        self._stood = False

    def checkpoint(self, state: Mapping[str, Any]) -> None:  # noqa: ARG002
        """The program's own state: for a replay by the same version."""
        self._stood = False

    def standing(self, content: Mapping[str, Any]) -> None:
        """Where the companion stands. Raises InputError, one line, when that is not said as declared."""
        standing = Standing.read(content)
        self._stood = True
        self._obeys(standing.system, profiles.named(standing.profile))
        self._state = standing.state
        for name, value in standing.parameters.items():
            self._set(name, value)

    def changed(self, content: Mapping[str, Any]) -> None:
        """The supervisor's state has changed. Raises InputError, one line, when that is not said as declared."""
        self._state = state_named(content)
        self._changes.append((self._now, self._state, reason_given(content)))

    def lost(self, turns: int) -> None:
        """So many turns are missing."""
        self._lost += turns

    def received(self, data: bytes, now: float) -> None:
        """Bytes came from the link."""
        self._goes_on(now)
        for fact in self._codec.facts(data):
            match fact:
                case GyroSample():
                    self._obeyed.gyro_at = now
                    self._sample(fact, now)
                case AppliedMoment():
                    self._thrust = fact.thrust
                    self._ages.append(fact.age_samples if fact.age_samples >= 0.0 else np.nan)
                case Heartbeat() if fact.make:
                    self._heartbeat(fact, now)

    def said(self, message: bytes) -> None:
        """The companion answered."""
        match self._spoken.read(message):
            case Correction(stamp_us, moment):
                row = self._row_of.get(stamp_us)
                if row is not None:  # a repeat is answered like the first one, and so the first answer is the one
                    self._answers.setdefault(row, self._axes.moment.inward(moment))
            case Telemetry() as told:
                self._telemetry.append((self._now, told.d_hat, told.rate_hz))
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
            started=self._first.started,
            machine=self._first.machine,
            generator=self._first.generator,
            design=str(json.loads(self._first.design).get("sha256", "")),
            time=clock.time,
            stamp_us=stamp_us,
            ended=float(max(clock.at(self._now), clock.time[-1])),
            restarts=clock.restarts,
            gyro=np.array(rates),
            state=np.array(states, dtype=np.int8),
            flying=np.array(flying),
            correction=np.array([self._answers.get(row, missing) for row in range(len(stamps))]),
            told=clock.at([at for at, _, _ in told]),
            d_hat=np.array([d_hat for _, d_hat, _ in told]),
            rate_hz=np.array([rate for _, _, rate in told]),
            ages=np.array(self._ages, dtype=np.float64),
            took=np.array(self._took, dtype=np.float64),
            changes=tuple(Change(float(clock.at(at)), state, why) for at, state, why in self._changes),
            settings=(
                *(Setting(-np.inf, name, value) for name, value in (self._at_start or {}).items()),
                *(Setting(float(clock.at(at)), name, value) for at, name, value in self._settings),
            ),
            lost=self._lost,
        )

    def _sample(self, sample: GyroSample, now: float) -> None:
        """A stamp that is not newer is a repeat or late, unless it is so much older that the clock began anew."""
        stamp, newest = sample.stamp_us, self._newest_us
        if newest is not None and newest - RESTART_US < stamp <= newest:
            return
        if newest is not None and stamp < newest:
            self._row_of.clear()  # stamps of the boot before mean nothing any more
        self._newest_us, self._row_of[stamp] = stamp, len(self._gyro)
        self._gyro.append((now, stamp, sample.rates, self._state, self._thrust >= FLYING))

    def _heartbeat(self, beat: Heartbeat, now: float) -> None:
        injecting = self._state.injecting
        if beat.system != self._obeyed.system and self._obeyed.may_become(beat.system, now, injecting=injecting):
            profile = self._obeyed.profile_for(beat)
            if profile is not None:
                self._obeys(beat.system, profile)
        if beat.system == self._obeyed.system:
            self._obeyed.beat(now, simulated=beat.simulated)

    def _obeys(self, system: int | None, profile: profiles.Profile) -> None:
        self._obeyed.system = self._codec.system = system
        self._obeyed.profile = self._codec.profile = profile

    def _goes_on(self, now: float) -> None:
        if not self._stood:
            by = self._first.generator if self._first else "its program"
            raise InputError(f"{by} did not record where the companion stands; only that version makes a page of it")
        self._now = now
        if self._at_start is None:
            self._at_start = dict(self._values)

    def _set(self, name: str, value: float) -> None:
        if name == "DOB_STATE" or self._values.get(name) == value:
            return
        self._values[name] = value
        if self._at_start is not None:
            self._settings.append((self._now, name, value))
