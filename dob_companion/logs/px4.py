"""What a PX4 log says of a flight, by the names that its versions have given it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from dob_companion.errors import LogError
from dob_companion.files import read_bytes
from dob_companion.identification.record import Floats, Record
from dob_companion.logs import mixer
from dob_companion.logs.choose import Source, chosen
from dob_companion.logs.columns import Table
from dob_companion.logs.found import Found, of_each, records
from dob_companion.logs.series import Series, both
from dob_companion.logs.ulog import MAGIC, ULog, pieces
from dob_companion.mavlink.makes import PX4
from dob_companion.mavlink.overheard import vehicle_in_words

_XYZ = ("xyz[0]", "xyz[1]", "xyz[2]")
_CONTROLS = ("control[0]", "control[1]", "control[2]")
_REMEDY = (
    "set SDLOG_PROFILE with bit 3 (system identification) or 4 (high rate), which bring vehicle_angular_velocity and "
    "vehicle_torque_setpoint at the full rate"
)
_ARMED = 2
"""vehicle_status.arming_state"""
_FORWARD = 2
"""vehicle_status.vehicle_type of a VTOL that flies as a plane"""
_AXES_LIMITED = 0x1F8
"""Bits of multirotor_motor_limits.saturation_status for roll, pitch and yaw."""


def looks_like_ulog(begin: bytes) -> bool:
    """Whether these first bytes are a log's of PX4."""
    return begin.startswith(MAGIC)


def read_ulog(path: Path) -> tuple[Record, ...]:
    """The records of the log, or of several in one file. Raises LogError, one line."""
    return of_each(pieces(read_bytes(path)), lambda data: _records(ULog(data), str(path)), str(path))


def _records(log: ULog, source: str) -> tuple[Record, ...]:
    said: list[str] = list(log.remarks)
    parameters = {name: value for _, name, value in log.settings}
    rates, moments = _rates(log), _moments(log)
    if not moments:
        moments = _of_the_motors(log, parameters, said)
    if not rates:
        raise LogError(f"{source}: no vehicle_angular_velocity, sensor_combined or vehicle_imu in it: {_REMEDY}")
    if not moments:
        lacking = f"{source}: no vehicle_torque_setpoint or actuator_controls_0 in it"
        raise LogError(f"{lacking}{_by_a_mixer_file(log, parameters)}: {_REMEDY}")
    taken, moment, words = chosen(rates, moments, link=False)
    if taken.words == "sensor_gyro":
        said.append("sensor_gyro is in the board's axes: taken as the body's")
    vehicle = _vehicle(log, parameters)
    return records(
        Found(
            source=source,
            make=PX4,
            vehicle=vehicle,
            rates=taken.series,
            moment=moment.series,
            others=_others(log),
            facts=_facts(log, vehicle, said),
            settings=log.settings,
            rates_filtered=taken.filtered,
            remarks=(words, *said),
        )
    )


def _table(log: ULog, name: str, columns: Sequence[str]) -> Table | None:
    table = log.table(name)
    return table if table is not None and table.has((*columns, "timestamp")) else None


def _time(table: Table, *, sampled: bool = False) -> Floats:
    """s since the autopilot's start: of the message, or of the measurement that it is of."""
    if sampled and "timestamp_sample" in table.names:
        stamps = table.column("timestamp_sample")
        if (stamps > 0).all():
            return 1e-6 * stamps
    return 1e-6 * table.column("timestamp")


def _series(log: ULog, name: str, columns: Sequence[str], *, sampled: bool = False) -> Series | None:
    table = _table(log, name, columns)
    return None if table is None else table.series(_time(table, sampled=sampled), columns)


def _rates(log: ULog) -> list[Source]:
    """vehicle_angular_velocity is after the filter IMU_GYRO_CUTOFF, the others are before it."""
    gyro = tuple(f"gyro_rad[{k}]" for k in range(3))
    found = [
        ("sensor_combined", _series(log, "sensor_combined", gyro), False),
        ("vehicle_imu", _of_the_imu(log), False),
        ("vehicle_angular_velocity", _series(log, "vehicle_angular_velocity", _XYZ, sampled=True), True),
        ("sensor_gyro", _series(log, "sensor_gyro", ("x", "y", "z"), sampled=True), False),
    ]
    return [Source(words, series, filtered) for words, series, filtered in found if series is not None]


def _of_the_imu(log: ULog) -> Series | None:
    angles = tuple(f"delta_angle[{k}]" for k in range(3))
    table = _table(log, "vehicle_imu", (*angles, "delta_angle_dt"))
    if table is None:
        return None
    turned = table.series(_time(table, sampled=True), angles)
    with np.errstate(divide="ignore", invalid="ignore"):
        return replace(turned, values=turned.values / (1e-6 * table.column("delta_angle_dt"))[:, None])


def _moments(log: ULog) -> list[Source]:
    found = [
        ("vehicle_torque_setpoint", _series(log, "vehicle_torque_setpoint", _XYZ)),
        ("actuator_controls_0", _series(log, "actuator_controls_0", _CONTROLS)),
    ]
    return [Source(words, series) for words, series in found if series is not None]


def _of_the_motors(log: ULog, parameters: dict[str, float], said: list[str]) -> list[Source]:
    """actuator_motors through the rotors' geometry."""
    factors = mixer.px4_factors(parameters)
    if factors is None:
        return []
    motors = _series(log, "actuator_motors", [f"control[{k}]" for k in range(len(factors))])
    if motors is None:
        return []
    curve = parameters.get("THR_MDL_FAC", 0.0)
    thrust = (1.0 - curve) * motors.values + curve * motors.values**2
    said.append(
        f"no torque is logged: moment unmixed from actuator_motors by CA_ROTOR0…{len(factors) - 1}, what "
        "the allocation cut off is missing in it"
    )
    return [Source("actuator_motors", replace(motors, values=mixer.unmixed(thrust, factors)))]


def _by_a_mixer_file(log: ULog, parameters: dict[str, float]) -> str:
    """What stands in the way of unmixing motors that are logged; "" where there are none."""
    outputs = next((name for name in ("actuator_motors", "actuator_outputs") if log.table(name) is not None), "")
    if not outputs or mixer.px4_factors(parameters) is not None:
        return ""
    frame = f"SYS_AUTOSTART {parameters['SYS_AUTOSTART']:g}" if "SYS_AUTOSTART" in parameters else "an airframe"
    return f"; {outputs} is there, but no CA_ROTOR* that say how it was mixed (before PX4 1.14 by a file of {frame})"


def _others(log: ULog) -> dict[str, Series]:
    found = {
        "rate_setpoint": _series(log, "vehicle_rates_setpoint", ("roll", "pitch", "yaw")),
        "attitude": _angles(_series(log, "vehicle_attitude", [f"q[{k}]" for k in range(4)], sampled=True)),
        "attitude_setpoint": _attitude_setpoint(log),
        "thrust": _thrust(log),
    }
    return {name: series for name, series in found.items() if series is not None}


def _attitude_setpoint(log: ULog) -> Series | None:
    asked = _series(log, "vehicle_attitude_setpoint", [f"q_d[{k}]" for k in range(4)])
    if asked is not None and (np.abs(asked.values) > 0.0).any(axis=1).all():
        return _angles(asked)
    return _series(log, "vehicle_attitude_setpoint", ("roll_body", "pitch_body", "yaw_body"))


def _angles(quaternions: Series | None) -> Series | None:
    """Roll, pitch, yaw of quaternions that turn the body's axes into those of the earth."""
    if quaternions is None:
        return None
    w, x, y, z = quaternions.values.T
    with np.errstate(invalid="ignore"):
        roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
        pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
        yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return replace(quaternions, values=np.column_stack((roll, pitch, yaw)))


def _thrust(log: ULog) -> Series | None:
    upward = _series(log, "vehicle_thrust_setpoint", ("xyz[2]",))
    if upward is not None:
        return replace(upward, values=-upward.values)
    return _series(log, "actuator_controls_0", ("control[3]",))


def _facts(log: ULog, vehicle: str, said: list[str]) -> dict[str, Series]:
    found: dict[str, Series | None] = {"armed": None, "flying": None, "saturated": None}
    state = _series(log, "vehicle_status", ("arming_state",))
    if state is not None:
        found["armed"] = replace(state, values=np.asarray(state.values == _ARMED, np.float64))
    else:
        found["armed"] = _series(log, "actuator_armed", ("armed",))
    landed = _series(log, "vehicle_land_detected", ("landed",))
    if landed is not None:
        flying = replace(landed, values=1.0 - landed.values)
        found["flying"] = _hovering(log, flying, said) if vehicle.startswith("vtol") else flying
    achieved = _series(log, "control_allocator_status", ("torque_setpoint_achieved",))
    limits = _series(log, "multirotor_motor_limits", ("saturation_status",))
    if achieved is not None:
        found["saturated"] = replace(achieved, values=1.0 - achieved.values)
    elif limits is not None:
        limited = (limits.values.astype(int) & _AXES_LIMITED) > 0
        found["saturated"] = replace(limits, values=np.asarray(limited, np.float64))
    return {name: series for name, series in found.items() if series is not None}


def _hovering(log: ULog, flying: Series, said: list[str]) -> Series:
    """In the air and not flying as a plane, of which a hover's model says nothing."""
    kind = _series(log, "vehicle_status", ("vehicle_type",))
    if kind is None or not (kind.values == _FORWARD).any():
        return flying
    said.append("flies as a plane for a while: counts as not flying, which is about hover")
    return both(flying, replace(kind, values=np.asarray(kind.values != _FORWARD, np.float64)))


def _vehicle(log: ULog, parameters: dict[str, float]) -> str:
    """By its MAV_TYPE, which vehicle_status holds and a parameter sets."""
    status = _table(log, "vehicle_status", ("system_type",))
    kind = status.column("system_type")[-1] if status is not None else parameters.get("MAV_TYPE", 0.0)
    return vehicle_in_words(round(float(kind) or parameters.get("MAV_TYPE", 0.0)))
