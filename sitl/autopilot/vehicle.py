"""One vehicle, one sample at a time: sensors, control, saturation, airframe. Pure; it knows no MAVLink and no clock."""

import struct
from typing import NamedTuple

from sitl.airframe.protocol import Airframe
from sitl.airframe.surroundings import Surroundings
from sitl.attitude import LEVEL, ZERO, Quaternion, Vector, attitude_error, down_component, multiply, turned_back
from sitl.autopilot.aircraft import Aircraft
from sitl.autopilot.controller import Pids, rate_setpoint
from sitl.autopilot.correction import CorrectionInput
from sitl.autopilot.imu import Gyro
from sitl.autopilot.position import AltitudeHold, PositionHold
from sitl.constants import DT_US

START_US = 10_000_000
"""Stamp of sample 0, µs: not zero, so that an empty field is never mistaken for a time."""

TAKEN_OFF = 0.9
"""Share of the altitude asked for at which a take-off is over; sinking below it later is no second one."""

STICKS_US = (1500,) * 4 + (1000,) * 14
"""Pulses of RC channels 1 to 18 as nobody touches them, µs: sticks in the middle, switches down."""

_SINGLES = struct.Struct("<3f")


class Sample(NamedTuple):
    """Everything about one sample; vectors are roll, pitch, yaw in hover axes.

    `rate` and `gyro` (y and y_n) in rad/s; `u_e`, `correction`, `disturbance` in normalized torque, `u_e` including the
    correction and saturation; `age` in samples, −1 when there is no correction; `attitude_error` in rad; `quaternion`
    scalar first; `rate_setpoint` r in rad/s; `thrust` 0…1; `specific_force` in m/s².
    """

    stamp_us: int
    rate: Vector
    gyro: Vector
    u_e: Vector
    correction: Vector
    age: int
    disturbance: Vector
    attitude_error: Vector
    rate_setpoint: Vector
    quaternion: Quaternion
    thrust: float
    specific_force: Vector


class Vehicle:
    """Airframe, controllers and the pilot's few switches (arm, take off, land).

    `attitude_command` is the pilot's. With `position_hold` (on for airframes that the wind can carry away) the attitude
    held is that command leaned over so that it stays where it left the ground, or where `hold.point` says. The rate of
    that lean may be fed forward to the rate controllers (`hold.feed_forward`), never that of the pilot's steps.

    The gyro reading and the applied torque are rounded to single precision where a real autopilot holds them as such,
    so what goes over the wire is exactly what the vehicle used.
    """

    def __init__(self, aircraft: Aircraft) -> None:
        self.airframe, self.mixer, tuning = aircraft.airframe, aircraft.mixer, aircraft.tuning
        self.attitude_gain = aircraft.attitude_gain  # 1/s, roll pitch yaw
        self.rate_gains = None if aircraft.rates else tuning.rate
        self.attitude_command: Quaternion = LEVEL
        self.armed = False
        self.pulses_us = list(STICKS_US)
        self.lockstep = False  # its clock is not the wall's; said in HEARTBEAT, changes no flight
        self.landing = False
        self.taking_off = False
        self.target_altitude: float | None = None
        self.gyro = Gyro()
        self.position_hold = tuning.position_hold
        self.hold = PositionHold()
        self.now_us = START_US - DT_US
        self._hover_thrust = tuning.hover_thrust
        self._altitude = AltitudeHold(tuning)
        self._rates = aircraft.rates or Pids(tuning.rate)

    @property
    def flying(self) -> bool:
        """Off the ground."""
        return not self.airframe.on_ground

    def arm(self) -> None:
        """Let the motors turn; it stays on the ground until told to take off."""
        self.armed = True

    def disarm(self) -> None:
        """Stop the motors at once, wherever it is."""
        self.armed, self.landing, self.taking_off, self.target_altitude = False, False, False, None

    def take_off(self, altitude: float) -> None:
        """Climb to `altitude` metres and stay. Needs an armed vehicle."""
        self.target_altitude, self.landing, self.taking_off = altitude, False, not self.flying

    def land(self) -> None:
        """Come down; it disarms itself on the ground."""
        self.landing = self.flying

    def step(self, around: Surroundings, noise: Vector, corrections: CorrectionInput) -> Sample:
        """Fly the next sample: read the gyro (`noise` in rad/s), compute and apply u_e, hold it to the sample after."""
        frame = self.airframe
        self.now_us = now = self.now_us + DT_US
        rate, attitude = frame.rate, frame.attitude
        gyro = _single(*self.gyro.read(rate, noise))
        correction, answers = corrections.at(now)  # after the gyro: without a link the answer to it may act at once
        held, turning = self._attitude_held(frame)
        error = attitude_error(held, attitude)
        setpoint = rate_setpoint(error, self.attitude_gain, turning)
        thrust = self._thrust(frame)
        if frame.on_ground or not self.armed:
            self._rates.reset()
            u_e, correction, setpoint = ZERO, ZERO, ZERO
        else:
            asked = self._torque(setpoint, gyro, correction)
            u_e, thrust = self.mixer.allocate(asked, thrust)
            u_e = _single(*u_e)
        frame.advance(u_e, thrust, around)
        if self.taking_off and self.target_altitude is not None:
            self.taking_off = frame.altitude < TAKEN_OFF * self.target_altitude
        if self.landing and frame.on_ground:
            self.disarm()
        return Sample(
            now,
            rate,
            gyro,
            u_e,
            correction,
            -1 if answers is None else (now - answers + DT_US // 2) // DT_US,
            ZERO if frame.on_ground else around.torque,
            error,
            setpoint,
            attitude,
            thrust,
            frame.specific_force,
        )

    def _torque(self, setpoint: Vector, gyro: Vector, correction: Vector) -> Vector:
        """C (r − y_n) + correction, per axis: what the mixer is asked for."""
        u = self._rates.step((setpoint[0] - gyro[0], setpoint[1] - gyro[1], setpoint[2] - gyro[2]))
        return u[0] + correction[0], u[1] + correction[1], u[2] + correction[2]

    def _attitude_held(self, frame: Airframe) -> tuple[Quaternion, Vector]:
        """The attitude commanded, and the body rate at which position hold turns it."""
        if not self.position_hold or frame.condition.held_axis is not None:
            return self.attitude_command, ZERO
        if frame.on_ground:
            north, east, _ = frame.position
            self.hold.reset(north, east)
            return self.attitude_command, ZERO
        leaning = self.hold.step(frame.position, frame.velocity)
        return multiply(leaning, self.attitude_command), turned_back(self.attitude_command, self.hold.rate)

    def _thrust(self, frame: Airframe) -> float:
        if not self.armed or (self.target_altitude is None and not self.landing):
            self._altitude.reset()
            return 0.0
        if frame.condition.held_axis is not None:  # the rod carries it; the rotors turn as in hover
            return self._hover_thrust
        target = None if self.landing else self.target_altitude
        return self._altitude.step(target, frame.altitude, frame.climb, down_component(frame.attitude))


def _single(x: float, y: float, z: float) -> Vector:
    """The three numbers rounded to single precision."""
    return _SINGLES.unpack(_SINGLES.pack(x, y, z))
