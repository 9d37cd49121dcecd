"""An aircraft's end of the link for tests of the pure companion: real MAVLink bytes, simulated time."""

import copy
import struct
from dataclasses import dataclass, field, fields
from functools import cache

import numpy as np
from pymavlink.dialects.v20 import common as mav

from dob_companion.artifact import Certificate, DobBlock, DobDesign, Problem, StateSpaceData, dumps
from dob_companion.companion import Companion, CompanionConfig
from dob_companion.flightlog.snapshot import Snapshots, restore
from dob_companion.supervisor import FirstEnabling, State

DT = 0.004
T0 = 10_000_000
AT_ONCE = CompanionConfig(first_enabling=FirstEnabling(shares=()))
"""Without steps at the first enabling in a flight."""


def gain(value):
    return StateSpaceData([], [], [], [[value]])


@cache
def small_design(axes=("roll", "pitch", "yaw"), delay_samples=1, delay_margin=3):
    """One block an axis, checkable by hand: d_hat(k+1) = 0.5 d_hat(k) + 0.5 (y_n(k) - u_e(k)).

    Its problem: y_n = u_e + d + 0.01 n with d(k+1) = 0.99 d(k) + 0.01 w(k), n and w white.
    """
    certificate = Certificate(
        gamma=1.0,
        gamma_star=1.0,
        gamma_star_method="hand-made",
        gamma_backoff=1.01,
        closed_loop_spectral_radius=0.9,
        observer_spectral_radius=0.5,
        slowest_mode_s=-DT / np.log(0.5),
        command_leak=0.0,
        disk_margin=1.0,
        delay_margin_samples=delay_margin,
        estimation_bandwidth_hz=10.0,
    )
    observer = StateSpaceData([[0.5]], [[0.5, -0.5]], [[1.0]], [[0.0, 0.0]])
    blocks = tuple(
        DobBlock(
            name=axis,
            axes=(axis,),
            delay_samples=delay_samples,
            observer=observer,
            problem=Problem(gain(1.0), gain(0.1), StateSpaceData([[0.99]], [[0.01]], [[1.0]], [[0.0]]), gain(0.01)),
            certificate=certificate,
        )
        for axis in axes
    )
    return dumps(
        DobDesign(dt=DT, delay_samples=delay_samples, blocks=blocks, created="2026-01-01T00:00:00Z", generator="tests")
    )[1]


@dataclass
class Aircraft:
    """Sends pairs of sample k to a companion and keeps what it says. Corrections are not applied unless a test does."""

    companion: Companion
    autopilot: int = mav.MAV_AUTOPILOT_GENERIC
    now: float = 0.0
    sample: int = 0
    rates: tuple = (0.0, 0.0, 0.0)
    moment: tuple = (0.0, 0.0, 0.0)
    contained: tuple = (0.0, 0.0, 0.0)
    thrust: float = 0.5
    age: float = 1.0
    armed: bool = True
    simulated: bool = False
    system_status: int = mav.MAV_STATE_ACTIVE
    beats: bool = True
    flight: tuple | None = None  # landed_state and vtol_state, told at 5 Hz
    pulses: list | None = None  # of the RC channels, told at 5 Hz
    said: list = field(default_factory=list)

    def __post_init__(self):
        self.out = mav.MAVLink(None, srcSystem=1, srcComponent=1)
        self.ground = mav.MAVLink(None, srcSystem=255, srcComponent=190)
        self.ear = mav.MAVLink(None)
        self.ear.robust_parsing = True

    @property
    def stamp(self):
        return T0 + round(self.sample * DT * 1e6)

    def deliver(self, *messages, by=None):
        for message in messages:
            self.companion.receive(bytes(message.pack(by or self.out)), self.now)
        return self.listen()

    def listen(self):
        self.companion.advance(self.now)
        heard = []
        for data in self.companion.bytes_to_send():
            heard += self.ear.parse_buffer(data) or []
        self.said += heard
        return heard

    def heartbeat(self):
        mode = (mav.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0) | (
            mav.MAV_MODE_FLAG_HIL_ENABLED if self.simulated else 0
        )
        return self.deliver(mav.MAVLink_heartbeat_message(2, self.autopilot, mode, 0, self.system_status, 3))

    def imu(self, stamp=None, rates=None):
        r = rates or self.rates
        stamp = self.stamp if stamp is None else stamp
        return mav.MAVLink_highres_imu_message(stamp, 0, 0, 0, *r, 0, 0, 0, 0, 0, 0, 0, 56)

    def target(self, stamp=None, moment=None, age=None):
        u = moment or self.moment
        stamp = self.stamp if stamp is None else stamp
        age = self.age if age is None else age
        if self.autopilot == mav.MAV_AUTOPILOT_PX4:
            return moment_array(stamp, u, self.thrust, self.contained, age)
        return mav.MAVLink_actuator_control_target_message(stamp, 0, [*u, self.thrust, *self.contained, age])

    def slow(self):
        if self.flight:
            landed, vtol = self.flight
            yield mav.MAVLink_extended_sys_state_message(vtol, landed)
        if self.pulses:
            yield mav.MAVLink_rc_channels_message(0, 18, *self.pulses, 255)

    def pair(self):
        """One sample as it should be, and a heartbeat each second; returns the corrections that answer it."""
        if self.beats and self.sample % 250 == 0:
            self.heartbeat()
        if self.sample % 50 == 0:
            self.deliver(*self.slow())
        heard = self.deliver(self.imu(), self.target())
        self.sample += 1
        self.now += DT
        return corrections(heard)

    def pairs(self, count):
        return [c for _ in range(count) for c in self.pair()]

    def write(self, name, value, kind=mav.MAV_PARAM_TYPE_REAL32, system=1, component=191):
        return self.deliver(
            mav.MAVLink_param_set_message(system, component, name.encode(), value, kind), by=self.ground
        )

    def until(self, state, limit=2000):
        for _ in range(limit):
            self.pair()
            if self.companion.status().state is state:
                return
        raise AssertionError(f"{state.name} not reached, still {self.companion.status().state.name}")

    def active(self):
        """Fly until the correction is fully faded in; an aircraft that was flown there before is taken up there."""
        begun = self.__dict__.pop("begun", None)
        untouched = begun is not None and begun[0] is self.companion and begun[2] == len(vars(self.companion))
        untouched = untouched and not (self.said or self.sample or self.now)
        how = (type(self), begun[1], repr([getattr(self, f.name) for f in fields(self)[1:]])) if untouched else None
        if how in _ACTIVE:
            _ACTIVE[how].take_up(self)
            return self
        self.heartbeat()
        self.pairs(600)
        self.write("DOB_ENABLE", 1.0)
        self.until(State.ACTIVE)
        if untouched:
            _ACTIVE[how] = Active(self)
        return self


@dataclass(frozen=True)
class Tunnelled:
    """A correction that came in a TUNNEL, with the fields of the DEBUG_VECT that it stands for."""

    time_usec: int
    x: float
    y: float
    z: float


def corrections(messages):
    found = []
    for m in messages:
        if m.get_type() == "DEBUG_VECT" and m.name == "DOB_CORR":
            found.append(m)
        elif m.get_type() == "TUNNEL" and m.payload_type == 53425:
            assert (m.target_system, m.target_component, m.payload_length) == (1, 1, 20)
            found.append(Tunnelled(*struct.unpack("<Q3f", bytes(m.payload[:20]))))
    return found


def moment_array(stamp, moment, thrust=0.5, contained=(0.0, 0.0, 0.0), age=1.0):
    """An applied moment as PX4's module tells it, at 250 Hz; age in samples as elsewhere."""
    age_us = age if age < 0 else 4000.0 * age
    data = [*moment, thrust, *contained, age_us]
    return mav.MAVLink_debug_float_array_message(stamp, b"DOB_ACT", 0, data + [0.0] * (58 - len(data)))


def texts(messages):
    return [m.text for m in messages if m.get_type() == "STATUSTEXT"]


def aircraft(config=None, **design):
    plane = Aircraft(Companion(small_design(**design), config or CompanionConfig()))
    plane.begun = (plane.companion, repr((config, sorted(design.items()))), len(vars(plane.companion)))
    return plane


class Active:
    """Where an aircraft was when its correction had faded in, and all that was said until then: some five simulated
    seconds, which a test that begins there need not fly again (test_snapshot.py: the snapshot is the whole state)."""

    def __init__(self, plane):
        self._state = Snapshots(plane.companion.newborn()).take(plane.companion)
        self._fields = {f.name: getattr(plane, f.name) for f in fields(plane) if f.name != "companion"} | {
            "said": list(plane.said)
        }
        self._sequence = [mavlink.seq for mavlink in (plane.out, plane.ground)]

    def take_up(self, plane):
        restore(plane.companion, self._state)
        for name, value in self._fields.items():
            setattr(plane, name, copy.copy(value))
        plane.out.seq, plane.ground.seq = self._sequence


_ACTIVE = {}


class Kept:
    """An aircraft as it was, to begin from again and again: to fly it there takes longer than what is tried then. What
    was said until then is left out."""

    def __init__(self, plane):
        self._kind, self._newborn = type(plane), plane.companion.newborn
        self._state = Snapshots(self._newborn()).take(plane.companion)
        self._fields = {f.name: getattr(plane, f.name) for f in fields(plane) if f.name not in ("companion", "said")}

    def again(self):
        companion = self._newborn()
        restore(companion, self._state)
        return self._kind(companion, **copy.deepcopy(self._fields))
