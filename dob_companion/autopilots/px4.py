"""PX4: RateControl (src/lib/rate_control/rate_control.cpp, update) on what VehicleAngularVelocity.cpp gives.

HIGHRES_IMU carries the mean rate over one interval of IMU_INTEG_RATE, before the filters of vehicle_angular_velocity:
these belong to the controller. It is K (P e + I ∫e − D s/(1 + s/w_d) y) with y behind IMU_GYRO_CUTOFF (second order)
and the notches, w_d from IMU_DGYRO_CUTOFF; yaw torque goes through MC_YAW_TQ_CUTOFF. FF acts on the command alone.
"""

import math

from dob_companion.autopilots.autopilot import Autopilot, RateLoop, nonzero
from dob_companion.autopilots.parameters import Parameters
from dob_companion.autopilots.transfer import Transfer, butterworth, constant, looped_low_pass, low_pass, notch, pid

LOOP_RATE, GYRO_FILTER, STREAM_RATE = "IMU_GYRO_RATEMAX", "IMU_GYRO_CUTOFF", "IMU_INTEG_RATE"
DERIVATIVE_FILTER, YAW_FILTER, BATTERY = "IMU_DGYRO_CUTOFF", "MC_YAW_TQ_CUTOFF", "MC_BAT_SCALE_EN"
_AXES = {"roll": "MC_ROLLRATE_", "pitch": "MC_PITCHRATE_", "yaw": "MC_YAWRATE_"}
_NOTCHES = ("IMU_GYRO_NF0_", "IMU_GYRO_NF1_")
_DYNAMIC = "IMU_GYRO_DNF_EN"


def _loop(parameters: Parameters, axis: str) -> RateLoop:
    own = _AXES[axis]
    p, i, d, k = (parameters.need(own + what) for what in "PIDK")
    derivative_hz, loop_hz = parameters.need(DERIVATIVE_FILTER), parameters.positive(LOOP_RATE)
    about = [", ".join(parameters.said(own + what) for what in "PIDK")]
    if d:
        about.append(f"{parameters.said(DERIVATIVE_FILTER)} Hz, first order")
        if not derivative_hz:
            about.append(f"D unfiltered, {parameters.said(LOOP_RATE)} Hz")
    # The gyro's own rate, far above the loop's, runs this filter.
    derivative = Transfer((1.0, 0.0), (1.0,)) * low_pass(derivative_hz or loop_hz / math.pi)
    filters, about_filters = _filters(parameters)
    controller = constant(k) * pid(p, i, d, derivative) * filters
    about += about_filters
    if axis == "yaw" and parameters.get(YAW_FILTER):  # not before 1.16
        controller *= looped_low_pass(parameters.get(YAW_FILTER), loop_hz)
        about.append(f"{parameters.said(YAW_FILTER)} Hz, first order, {parameters.said(LOOP_RATE)} Hz")
    rate = min(max(parameters.need(STREAM_RATE), 50.0), 1000.0)  # as VehicleIMU.cpp does
    return RateLoop(
        controller=controller,
        about_controller=tuple(about),
        about_filters=(f"{parameters.said(STREAM_RATE)} Hz: a mean over one interval is half of it late; no filter",),
        gyro=filters,
        about_gyro=tuple(about_filters),
        late_s=0.5 / rate,
        remarks=(
            *nonzero(parameters, (own + "FF",), "on the command only, no part of C"),
            *nonzero(parameters, (_DYNAMIC,), "notches that move, not modelled; they are late by some of a ms"),
            *nonzero(parameters, (BATTERY,), "gains change with the battery: switch it off"),
        ),
    )


def _filters(parameters: Parameters) -> tuple[Transfer, list[str]]:
    """What the controller sees the rate through."""
    filters = butterworth(parameters.need(GYRO_FILTER))
    about = [f"{parameters.said(GYRO_FILTER)} Hz, second order"]
    for each in _NOTCHES:
        centre, width = parameters.get(each + "FRQ"), parameters.get(each + "BW")
        if centre and width:
            filters *= notch(centre, centre / width)
            about.append(f"static notch: {parameters.said(each + 'FRQ')}, {parameters.said(each + 'BW')}")
    return filters, about


PX4 = Autopilot(
    name="PX4",
    telltale="MC_ROLLRATE_P",
    names=(
        *(own + what for own in _AXES.values() for what in ("P", "I", "D", "K", "FF")),
        "MC_ROLL_P",
        LOOP_RATE,
        GYRO_FILTER,
        DERIVATIVE_FILTER,
        STREAM_RATE,
        YAW_FILTER,
        BATTERY,
        _DYNAMIC,
        *(each + what for each in _NOTCHES for what in ("FRQ", "BW")),
    ),
    attitude_gain="MC_ROLL_P",
    delay_samples=2,
    loop=_loop,
)
