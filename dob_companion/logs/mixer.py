"""The moment out of what the motors were told, through the frame's allocation, where no torque is logged.

ArduPilot: motor i gets thrust + roll·r_i + pitch·p_i + yaw·y_i, factors scaled to ±0.5 (AP_MotorsMatrix), then a curve
from thrust to throttle (AP_Motors_Thrust_Linearization). PX4: the pseudo-inverse of the rotors' geometry CA_ROTOR*,
scaled (ControlAllocationPseudoInverse). What the mixer cut off is missing in the result, as it is in the air.
"""

import math
from collections.abc import Mapping

import numpy as np

from dob_companion.identification.record import Floats

_CW, _CCW = -1.0, 1.0

_X = (45, -135, -45, 135)
_QUAD = {
    0: ((90, _CCW), (-90, _CCW), (0, _CW), (180, _CW)),
    1: tuple(zip(_X, (_CCW, _CCW, _CW, _CW), strict=True)),
    2: tuple(zip(_X, (0.7981, 1.0, -0.7981, -1.0), strict=True)),
    3: tuple(zip(_X, (_CW, _CW, _CCW, _CCW), strict=True)),
    12: ((135, _CW), (45, _CCW), (-135, _CCW), (-45, _CW)),
    13: ((45, _CCW), (-45, _CW), (-135, _CCW), (135, _CW)),
    14: ((45, _CCW), (135, _CW), (-135, _CCW), (-45, _CW)),
    18: ((135, _CCW), (45, _CW), (-135, _CW), (-45, _CCW)),
}
_HEXA = {
    0: ((0, _CW), (180, _CCW), (-120, _CW), (60, _CCW), (-60, _CCW), (120, _CW)),
    1: ((90, _CW), (-90, _CCW), (-30, _CW), (150, _CCW), (30, _CCW), (-150, _CW)),
}
_OCTA_YAW = (_CW, _CW, _CCW, _CCW, _CCW, _CCW, _CW, _CW)
_OCTA = {
    0: tuple(zip((0, 180, 45, 135, -45, -135, -90, 90), _OCTA_YAW, strict=True)),
    1: tuple(zip((22.5, -157.5, 67.5, 157.5, -22.5, -112.5, -67.5, 112.5), _OCTA_YAW, strict=True)),
}
_FRAMES: Mapping[int, Mapping[int, tuple[tuple[float, float], ...]]] = {1: _QUAD, 2: _HEXA, 3: _OCTA}
"""FRAME_CLASS, FRAME_TYPE: angle of each motor in degrees, clockwise from the nose, and its yaw factor."""

_FIRST_MOTOR, _MOTORS = 33, 8
_OUTPUTS = 14


def ardupilot_factors(parameters: Mapping[str, float]) -> Floats | None:
    """Roll, pitch and yaw factors of the motors, (n, 3); None for a frame that is not one of these."""
    frame = _FRAMES.get(round(parameters.get("FRAME_CLASS", 0)), {}).get(round(parameters.get("FRAME_TYPE", -1)))
    if frame is None:
        return None
    angles = [math.radians(angle) for angle, _ in frame]
    factors = np.array(
        [(-math.sin(angle), math.cos(angle), yaw) for angle, (_, yaw) in zip(angles, frame, strict=True)]
    )
    return np.asarray(0.5 * factors / np.abs(factors).max(axis=0))


def ardupilot_outputs(parameters: Mapping[str, float], motors: int) -> list[int] | None:
    """Number of the output, from 1, of each motor; None where one has none. Without functions, in order."""
    functions = {round(parameters.get(f"SERVO{k}_FUNCTION", -1)): k for k in range(_OUTPUTS, 0, -1)}
    if set(functions) == {-1}:
        return list(range(1, motors + 1))
    wanted = [functions.get(_FIRST_MOTOR + motor) for motor in range(motors)]
    return None if None in wanted or motors > _MOTORS else [output for output in wanted if output is not None]


def ardupilot_thrust(pulses_us: Floats, parameters: Mapping[str, float]) -> Floats:
    """Thrust of each motor, 0…1, from its pulse in µs. A range of 0 stands for that of the throttle stick."""
    low = parameters.get("MOT_PWM_MIN", 1000.0) or parameters.get("RC3_MIN", 1000.0)
    high = parameters.get("MOT_PWM_MAX", 2000.0) or parameters.get("RC3_MAX", 2000.0)
    spin_low, spin_high = parameters.get("MOT_SPIN_MIN", 0.15), parameters.get("MOT_SPIN_MAX", 0.95)
    expo = parameters.get("MOT_THST_EXPO", 0.65)
    throttle = ((pulses_us - low) / max(high - low, 1.0) - spin_low) / max(spin_high - spin_low, 1e-3)
    throttle = np.clip(throttle, 0.0, 1.0)
    return np.asarray(throttle * (1.0 - expo + expo * throttle))


def px4_factors(parameters: Mapping[str, float]) -> Floats | None:
    """Roll, pitch and yaw factors of the rotors as PX4 scales them, (n, 3); None without a geometry of fixed rotors."""
    count = round(parameters.get("CA_ROTOR_COUNT", 0))
    if count < 4 or any(f"CA_ROTOR{i}_PX" not in parameters for i in range(count)):
        return None
    geometry = np.array(
        [
            (
                -parameters.get(f"CA_ROTOR{i}_PY", 0.0),
                parameters[f"CA_ROTOR{i}_PX"],
                parameters.get(f"CA_ROTOR{i}_KM", 0.05),
                -1.0,
            )
            for i in range(count)
        ]
    )
    factors = np.linalg.pinv(geometry.T)[:, :3]
    used = (np.abs(factors) > 1e-3).sum(axis=0)
    size = np.sqrt((factors**2).sum(axis=0) / np.maximum(used / 2.0, 1.0))
    scale = np.array([max(size[0], size[1])] * 2 + [np.abs(factors[:, 2]).max()])
    return None if (scale < 1e-9).any() else np.asarray(factors / scale)


def unmixed(thrust: Floats, factors: Floats) -> Floats:
    """Roll, pitch, yaw, (n, 3), from the thrusts (n, motors): least squares, the collective set apart."""
    mixer = np.column_stack((factors, np.ones(len(factors))))
    return np.asarray(thrust @ np.linalg.pinv(mixer).T)[:, :3]
