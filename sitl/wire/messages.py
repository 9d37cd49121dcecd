"""The vehicle's own messages, each built from the vehicle and its newest sample."""

from collections.abc import Callable
from math import asin, atan2, cos, degrees, hypot, radians

from pymavlink.dialects.v20 import common as mavlink

from sitl.attitude import Quaternion, Vector
from sitl.autopilot.vehicle import Sample, Vehicle
from sitl.wire.port import Message

HOME_LAT, HOME_LON, HOME_ALT = 223364000, 1142655000, 50_000
"""Degrees · 1e7 and mm above sea: the campus where the paper's vehicle was built, roughly. Where it stands changes
nothing."""

METRES_PER_DEGREE = 111_195.0
"""Along a meridian of a sphere of 6371 km; a parallel is shorter by the cosine of the latitude."""

_SENSORS = (
    mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
    | mavlink.MAV_SYS_STATUS_SENSOR_GPS
    | mavlink.MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL
    | mavlink.MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION
    | mavlink.MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL
    | mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
    | mavlink.MAV_SYS_STATUS_PREARM_CHECK
)
_ACCEL_AND_GYRO = 0b111111  # the fields of HIGHRES_IMU that are measured
_NO_MODE = 0

Builder = Callable[[Vehicle, Sample], Message]


def _forward(v: Vector) -> Vector:
    x, y, z = v
    return -z, y, x


IMU_FRAMES: dict[str, Callable[[Vector], Vector]] = {"hover": lambda v: v, "forward-flight": _forward}
"""How an IMU is mounted: in hover axes, or, as in a tail-sitter, in those of forward flight (nose, right wing, belly),
whose x points up in hover."""


def highres_imu(s: Sample, frame: str = "hover") -> Message:
    """HIGHRES_IMU: y_n(k) in the gyro fields, rad/s; specific force in the accelerometer's, m/s²."""
    turned = IMU_FRAMES[frame]
    (ax, ay, az), (gx, gy, gz) = turned(s.specific_force), turned(s.gyro)
    return mavlink.MAVLink_highres_imu_message(
        s.stamp_us, ax, ay, az, gx, gy, gz, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, _ACCEL_AND_GYRO
    )


def actuator_control_target(s: Sample) -> Message:
    """ACTUATOR_CONTROL_TARGET: u_e(k), thrust, the correction contained in u_e and its age in samples."""
    controls = (*s.u_e, s.thrust, *s.correction, float(s.age))
    return mavlink.MAVLink_actuator_control_target_message(s.stamp_us, 0, controls)


def heartbeat(vehicle: Vehicle, *, ardupilot: bool = False) -> Message:
    """HEARTBEAT of a tail-sitter with an autopilot of no known make, or ArduPilot's; in lockstep its clock is not the
    wall's."""
    make = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA if ardupilot else mavlink.MAV_AUTOPILOT_GENERIC
    mode = mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED | mavlink.MAV_MODE_FLAG_GUIDED_ENABLED
    if vehicle.lockstep:
        mode |= mavlink.MAV_MODE_FLAG_HIL_ENABLED
    if vehicle.armed:
        mode |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    state = mavlink.MAV_STATE_ACTIVE if vehicle.armed else mavlink.MAV_STATE_STANDBY
    return mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_VTOL_QUADROTOR, make, mode, _NO_MODE, state, 3)


def autopilot_version() -> Message:
    """AUTOPILOT_VERSION: MAVLink 2, commands as COMMAND_INT too, parameters as plain floats."""
    capabilities = (
        mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2
        | mavlink.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
        | mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
    )
    none = [0] * 8
    return mavlink.MAVLink_autopilot_version_message(capabilities, 0, 0, 0, 0, none, none, none, 0, 0, 1)


def _ms(s: Sample) -> int:
    return s.stamp_us // 1000


def euler(q: Quaternion) -> Vector:
    """Roll, pitch, yaw in rad (z-y-x), hover axes."""
    w, x, y, z = q
    return (
        atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x)))),
        atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )


def _attitude_quaternion(_: Vehicle, s: Sample) -> Message:
    return mavlink.MAVLink_attitude_quaternion_message(_ms(s), *s.quaternion, *s.gyro)


def _attitude(_: Vehicle, s: Sample) -> Message:
    return mavlink.MAVLink_attitude_message(_ms(s), *euler(s.quaternion), *s.gyro)


def landed_state(v: Vehicle) -> int:
    """MAV_LANDED_STATE of the vehicle."""
    if not v.flying:
        return int(mavlink.MAV_LANDED_STATE_ON_GROUND)
    if v.landing:
        return int(mavlink.MAV_LANDED_STATE_LANDING)
    return int(mavlink.MAV_LANDED_STATE_TAKEOFF if v.taking_off else mavlink.MAV_LANDED_STATE_IN_AIR)


def _extended_sys_state(v: Vehicle, _: Sample) -> Message:
    return mavlink.MAVLink_extended_sys_state_message(mavlink.MAV_VTOL_STATE_MC, landed_state(v))


def _sys_status(_: Vehicle, __: Sample) -> Message:
    no_current, no_remaining = -1, -1
    return mavlink.MAVLink_sys_status_message(
        _SENSORS, _SENSORS, _SENSORS, 0, 65535, no_current, no_remaining, 0, 0, 0, 0, 0, 0
    )


def _latitude_longitude(v: Vehicle) -> tuple[int, int]:
    """Degrees · 1e7 of where it is now, on a sphere."""
    north, east, _ = v.airframe.position
    shrunk = cos(radians(HOME_LAT * 1e-7))
    return (
        HOME_LAT + round(north / METRES_PER_DEGREE * 1e7),
        HOME_LON + round(east / (METRES_PER_DEGREE * shrunk) * 1e7),
    )


def _global_position_int(v: Vehicle, s: Sample) -> Message:
    above = round(v.airframe.altitude * 1000.0)
    heading = round(degrees(euler(s.quaternion)[2]) * 100.0) % 36000
    north, east, down = (max(-32767, min(32767, round(each * 100.0))) for each in v.airframe.velocity)
    return mavlink.MAVLink_global_position_int_message(
        _ms(s), *_latitude_longitude(v), HOME_ALT + above, above, north, east, down, heading
    )


def _local_position_ned(v: Vehicle, s: Sample) -> Message:
    return mavlink.MAVLink_local_position_ned_message(_ms(s), *v.airframe.position, *v.airframe.velocity)


def _gps_raw_int(v: Vehicle, s: Sample) -> Message:
    altitude = HOME_ALT + round(v.airframe.altitude * 1000.0)
    fix, (latitude, longitude) = mavlink.GPS_FIX_TYPE_3D_FIX, _latitude_longitude(v)
    speed = min(65534, round(hypot(*v.airframe.velocity[:2]) * 100.0))
    return mavlink.MAVLink_gps_raw_int_message(
        s.stamp_us, fix, latitude, longitude, altitude, 100, 100, speed, 65535, 10
    )


def _home_position(_: Vehicle, s: Sample) -> Message:
    upright = (1.0, 0.0, 0.0, 0.0)
    return mavlink.MAVLink_home_position_message(
        HOME_LAT, HOME_LON, HOME_ALT, 0.0, 0.0, 0.0, upright, 0.0, 0.0, 0.0, s.stamp_us
    )


def _servo_output_raw(v: Vehicle, s: Sample) -> Message:
    """Four motors, 1000…2000 µs, in the order of `mixer`."""
    motors = v.mixer.commands(s.u_e, s.thrust) if v.armed else (0.0,) * 4
    widths = [1000 + round(1000.0 * each) for each in motors]
    return mavlink.MAVLink_servo_output_raw_message(s.stamp_us % 2**32, 0, *widths, 0, 0, 0, 0)


def _rc_channels(v: Vehicle, s: Sample) -> Message:
    return mavlink.MAVLink_rc_channels_message(s.stamp_us // 1000 % 2**32, len(v.pulses_us), *v.pulses_us, 255)


def _vfr_hud(v: Vehicle, s: Sample) -> Message:
    heading = round(degrees(euler(s.quaternion)[2])) % 360
    above_sea = HOME_ALT / 1000.0 + v.airframe.altitude
    return mavlink.MAVLink_vfr_hud_message(0.0, 0.0, heading, round(s.thrust * 100.0), above_sea, v.airframe.climb)


BUILDERS: dict[int, Builder] = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: lambda v, _: heartbeat(v),
    mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: lambda _, __: autopilot_version(),
    mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: lambda _, s: highres_imu(s),
    mavlink.MAVLINK_MSG_ID_ACTUATOR_CONTROL_TARGET: lambda _, s: actuator_control_target(s),
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: _attitude_quaternion,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: _attitude,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: _extended_sys_state,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: _sys_status,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: _global_position_int,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: _local_position_ned,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: _gps_raw_int,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION: _home_position,
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: _servo_output_raw,
    mavlink.MAVLINK_MSG_ID_VFR_HUD: _vfr_hud,
    mavlink.MAVLINK_MSG_ID_RC_CHANNELS: _rc_channels,
}
"""Everything that can be streamed or requested, by message id."""
