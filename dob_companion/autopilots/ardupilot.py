"""ArduPilot: AC_PID (libraries/AC_PID/AC_PID.cpp, update_all) behind INS_GYRO_FILTER and the harmonic notches
(AP_InertialSensor_Backend.cpp, apply_gyro_filters).

HIGHRES_IMU carries the rate that the rate controller sees, after those filters: they belong to the plant. The
controller is P e + I ∫e + D s/(1 + s/w_d) e with e behind a low-pass (FLTE), each part a backward difference at
SCHED_LOOP_RATE. FLTT, FF and D_FF act on the command alone.
"""

import math
from functools import cache

from dob_companion.autopilots.autopilot import Autopilot, RateLoop, nonzero
from dob_companion.autopilots.parameters import Parameters
from dob_companion.autopilots.transfer import (
    NOTHING,
    Transfer,
    butterworth,
    looped_derivative,
    looped_low_pass,
    notch,
    pid,
)

LOOP_RATE, GYRO_FILTER = "SCHED_LOOP_RATE", "INS_GYRO_FILTER"
SCRIPT_HZ = 180.0
"""So often deploy/ardupilot/dob_correction.lua ran beside a main loop of 400 Hz (docs/ardupilot.md)."""
QUADPLANE = "Q_ENABLE"
"""Whether a plane hovers on rotors besides."""
_AXES = {"roll": "RLL", "pitch": "PIT", "yaw": "YAW"}
_OF_AN_AXIS = ("P", "I", "D", "FF", "D_FF", "FLTT", "FLTE", "FLTD", "SMAX", "PDMX", "NEF")
_NOTCHES = ("INS_HNTCH_", "INS_HNTC2_")
_OF_A_NOTCH = ("ENABLE", "MODE", "FREQ", "BW", "ATT", "HMNCS", "OPTS")
_SEVERAL_IN_ONE = 0b1010001
"""Bits of OPTS that put two, three or five notches in the place of one."""


def prefix_for(vehicle: str) -> str:
    """ATC_ of Copter, Q_A_ of a quadplane, by the words of its heartbeat."""
    rotors = "rotor" in vehicle or "copter" in vehicle or "coaxial" in vehicle
    return "ATC_" if rotors and not vehicle.startswith("vtol") else "Q_A_"


@cache
def ardupilot(prefix: str) -> Autopilot:
    """ArduPilot with this prefix of its attitude controller's parameters."""
    gains = [f"{prefix}RAT_{short}_{what}" for short in _AXES.values() for what in _OF_AN_AXIS]
    notches = [each + what for each in _NOTCHES for what in _OF_A_NOTCH]
    angle, boost = f"{prefix}ANG_RLL_P", f"{prefix}THR_G_BOOST"
    quadplane = () if prefix == "ATC_" else (QUADPLANE,)
    return Autopilot(
        name="ArduPilot" if prefix == "ATC_" else "ArduPilot quadplane",
        telltale=f"{prefix}RAT_RLL_P",
        names=(*gains, angle, boost, LOOP_RATE, GYRO_FILTER, *notches, *quadplane),
        attitude_gain=angle,
        delay_samples=2,
        moment_rate_hz=SCRIPT_HZ,
        loop=lambda parameters, axis: _loop(parameters, axis, prefix),
    )


def _loop(parameters: Parameters, axis: str, prefix: str) -> RateLoop:
    def name(what: str) -> str:
        return f"{prefix}RAT_{_AXES[axis]}_{what}"

    p, i, d = (parameters.need(name(what)) for what in "PID")
    error_hz, derivative_hz = parameters.need(name("FLTE")), parameters.need(name("FLTD"))
    loop_hz = parameters.positive(LOOP_RATE)
    about = [", ".join(parameters.said(name(what)) for what in ("P", "I", "D")), parameters.said(name("FLTE"))]
    if d:
        about.append(parameters.said(name("FLTD")))
        if not derivative_hz:
            about.append("D unfiltered")
    about.append(f"{parameters.said(LOOP_RATE)} Hz")
    filters, about_filters, remarks = _gyro(parameters)
    return RateLoop(
        controller=pid(p, i, d, looped_derivative(derivative_hz, loop_hz)) * looped_low_pass(error_hz, loop_hz),
        about_controller=tuple(about),
        filters=filters,
        about_filters=about_filters,
        gyro=filters,
        about_gyro=about_filters,
        remarks=(
            *remarks,
            *nonzero(parameters, (name("FF"), name("D_FF"), name("FLTT")), "on the command only, no part of C"),
            *nonzero(parameters, (name("SMAX"), name("PDMX")), "limits P and D while it acts, not modelled"),
            *nonzero(parameters, (name("NEF"),), "a notch on the error, not modelled"),
            *nonzero(parameters, (f"{prefix}THR_G_BOOST",), "gains change with fast throttle, not modelled"),
        ),
    )


def _gyro(parameters: Parameters) -> tuple[Transfer, tuple[str, ...], tuple[str, ...]]:
    """Filters between rate and stream, and what of them is modelled and what is not."""
    hz = parameters.need(GYRO_FILTER)
    filters, about, remarks = butterworth(hz), [f"{parameters.said(GYRO_FILTER)} Hz, second order"], []
    for each in _NOTCHES:
        if not parameters.get(each + "ENABLE"):
            continue
        said = ", ".join(filter(None, (parameters.said(each + what) for what in _OF_A_NOTCH[1:])))
        centre, width = (parameters.need(each + what) for what in ("FREQ", "BW"))
        if parameters.need(each + "MODE") or int(parameters.get(each + "OPTS")) & _SEVERAL_IN_ONE:
            remarks.append(f"{said}: a notch that moves or is several, not modelled; it is late by some of a ms")
        elif centre > 0.5 * width > 0.0:
            filters *= _notches(
                centre, width, parameters.get(each + "ATT", 40.0), int(parameters.get(each + "HMNCS", 3))
            )
            about.append(f"static notches: {said}")
    return filters, tuple(about), tuple(remarks)


def _notches(centre: float, width: float, attenuation_db: float, harmonics: int) -> Transfer:
    """NotchFilter.cpp: A² is the amplitude that is left, and all harmonics have the quality of the first."""
    octaves = 2.0 * math.log2(centre / (centre - 0.5 * width))
    quality = math.sqrt(2.0**octaves) / (2.0**octaves - 1.0)
    whole = NOTHING
    for k in range(16):
        if harmonics >> k & 1:
            whole *= notch((k + 1) * centre, quality, 10.0 ** (-attenuation_db / 20.0))
    return whole
