# ruff: noqa: E501 — a page with tables
"""docs/vehicle.md from the tail-sitter's own numbers; about ten seconds more where it must compile first."""

import numpy as np

from sitl.airframe.linear import PITCH
from sitl.autopilot.controller import ATTITUDE_GAIN
from sitl.autopilot.position import SHAPING_S
from sitl.autopilot.tuning import RATE_PIDS
from sitl.constants import DT
from sitl.errors import FlightFailedError
from sitl.tailsitter.parameters import Parameters, table
from sitl.tailsitter.trim import linearize, trim

AXES = ("roll", "pitch", "yaw")
BAND = (4.0, 6.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0)
WINDS = (0.0, 3.0, 6.0, 8.0, 10.0)

TEXT = """# The simulated tail-sitter

Printed from the code by `python -m docs`: every number below is computed from `sitl/tailsitter/parameters.py`.
A scenario flies it with `airframe = "tailsitter"`; `airframe = "linear"` flies the paper's identified axes instead.

## What is modelled, and where it ends

| part | model | limits |
| --- | --- | --- |
| body (`body.py`) | six degrees of freedom, unit quaternion, classical Runge–Kutta, four steps of 0.87 ms after the command delay in each 4 ms sample | flat earth; principal axes are the hover axes; standing on the ground nothing moves but the rotors, and coming down to it, however hard, is a landing |
| rotors (`rotors.py`) | first-order lag of speed, limits, thrust and torque falling with advance ratio, in-plane drag, spin and its reaction on the body, canted axes for yaw | inflow by the air speed of the centre of mass: the damping that turning adds is left out, since (11) is a pure integrator from 4 rad/s on |
| ground and wall | four-rotor ground effect after Sanchez-Cuevas; thrust lost near a wall | level ground; the wall's size and form are a guess |
| slipstream | momentum theory, part of it over the two inner wing panels | quasi-steady; the share is a guess, since the propellers stand beside the wing |
| wing (`wing.py`) | four panels, thin wing blended into a flat plate at any angle of attack, force moving from a quarter to half the chord | symmetrical section, no dynamic stall, no elevons |
| flexible modes (`flexible.py`) | three, driven by the rotors' torque, felt by the gyro; off unless asked for | shapes, frequencies and damping are guesses; no reaction on the rigid body |
| battery (`battery.py`) | open-circuit voltage linear in charge, internal resistance, top speed in proportion to voltage; off unless asked for | no relaxation, no temperature |
| payload | a point mass rigidly below | no swinging; release does not move the origin |
| gyro and clock (`sitl/autopilot/imu.py`) | noise from the scenario, bias, latency, quantization; stamps with grid, jitter and skew | no scale error, no drift; the value stamped is that of the exact time |

The paper's disturbance d enters where u_e does: behind the same delay and lag, as a torque that the rotors need not
make, so it has no limits of its own.

## Speed

With numba (`pip install dob-companion[sitl]`) a sample costs 12 to 14 µs on a quiet core, controllers and mixer included:
about 300 times real time; `python -m bench vehicle` measures it beside the linear axes. The first flight after an
installation compiles for some ten seconds, later ones load what was compiled. Without numba the same functions run as
plain Python, with the same numbers, at about real time. Linear flights import neither.

## Control

The paper's cascade: e = 2 sgn(q₀) vec(q_cmd⁻¹ ⊗ q) times −{attitude_gain} 1/s asks for a rate, a PID makes torque of the
rate error. Pitch has (12). Roll and yaw have what their authority allows; the paper prints no gains for them.

{loops}

The mixer (`sitl/airframe/mixer.py`) asks each rotor for {share:.3g} of its full thrust per unit of torque: full scale is far beyond the
rotors, as the gain of (11) says. What gives way first is thrust, then yaw, then roll and pitch together: PX4's air mode
on all axes. u_e is what is left. Around it a cascade holds position (lean up to 45°) and altitude, with integrals for
wind, payload and battery. In scenarios with the event `feed_forward` the lean that holds position turns smoothly (two lags
of {shaping:g} s) and its rate is added to the rate asked for, as ArduPilot's ATC_RATE_FF_ENAB does; the pilot's attitude is
followed by the error alone.

## Hover and the paper's pitch model

Hover is found by Newton's method on the six accelerations, in still air and in wind. With the belly to the wind:

{trims}

Linearized in still air, from u_e to y at 250 Hz, against (11):

{pitch}

The pole of (11) is 70 ms of rotor lag, exp(−4/70.4) = 0.9447. Its zero at −1.716 is no property of the air: a double
integrator sampled with its input held has a zero near −1, and {delay:.2f} ms of delay moves it there. Rotors canted
outwards as well, as in the PX4 model, would delay pitch by 4 ms in the same way: one that must spin up turns the body
the wrong way first.

Roll is pitch's shape at a third of its gain, with 4 ms of such delay. Yaw has a tenth of the gain at low frequency; the
reaction of the rotors' inertia gives it lead, and the wing in the slipstream damps it by some 0.5 rad/s:

{others}

## Parameters

{parameters}
"""


def vehicle_page() -> str:
    """The page as Markdown."""
    p = Parameters()
    return TEXT.format(
        attitude_gain=ATTITUDE_GAIN,
        loops=_loops(p),
        share=p.mixer_share,
        shaping=SHAPING_S,
        trims=_trims(p),
        pitch=_pitch(p),
        delay=1e3 * p.delay,
        others=_others(p),
        parameters=table(),
    )


def _rows(head: str, rows: list[str]) -> str:
    return "\n".join([head, "|" + " --- |" * (head.count("|") - 1), *rows])


def _loops(p: Parameters) -> str:
    w = np.geomspace(1.0, 780.0, 3000)
    z, hover, rows = np.exp(1j * w * DT), linearize(p), []
    for axis, name in enumerate(AXES):
        g = RATE_PIDS[axis]
        rate = hover.response(w, axis) * g.gain * (z - g.zeros[0]) * (z - g.zeros[1]) / (z * (z - 1.0))
        whole = rate * (1.0 + ATTITUDE_GAIN * 0.5 * DT * (z + 1.0) / (z - 1.0))
        k = int(np.nonzero(np.abs(rate) > 1.0)[0][-1])
        margin = (180.0 + np.angle(rate[k], deg=True)) % 360.0
        peak = 1.0 / np.abs(1.0 + whole).min()
        rows.append(
            f"| {name} | {g.gain:g} | {g.zeros[0]:g}, {g.zeros[1]:g} | {w[k] / (2 * np.pi):.1f} Hz | {margin:.0f}° | {peak:.2f} |"
        )
    head = "| axis | gain | zeros | rate loop crosses at | phase margin | peak sensitivity, attitude loop closed |"
    return _rows(head, rows)


def _trims(p: Parameters) -> str:
    rows = []
    for wind in WINDS:
        try:
            at = trim(p, (wind, 0.0, 0.0))
        except FlightFailedError:
            rows.append(f"| {wind:g} | none | | |")
            continue
        lean = abs(np.degrees(2.0 * np.arcsin(at.attitude[2])))
        rows.append(f"| {wind:g} | {lean:.1f}° | {at.thrust:.3f} | {at.torque[1] + 0.0:.4f} |")
    return _rows("| wind, m/s | lean | thrust | pitch torque |", rows)


def _pitch(p: Parameters) -> str:
    w = np.array(BAND)
    z = np.exp(1j * w * DT)
    paper = PITCH.gain * (z - PITCH.zero) / ((z - 1.0) * (z - PITCH.pole))
    ratio = linearize(p).response(w, 1) / paper
    rows = [
        f"| {f:g} | {100.0 * (abs(r) - 1.0):+.2f} % | {np.angle(r, deg=True):+.2f}° |"
        for f, r in zip(w, ratio, strict=True)
    ]
    return _rows("| rad/s | gain over (11) | phase over (11) |", rows)


def _others(p: Parameters) -> str:
    w, hover = np.array(BAND), linearize(p)
    roll, pitch, yaw = (hover.response(w, axis) for axis in range(3))
    rows = [
        f"| {f:g} | {abs(r / q):.3f} | {np.angle(r / q, deg=True):+.1f}° | {abs(y / q):.3f} | {np.angle(y / q, deg=True):+.1f}° |"
        for f, r, q, y in zip(w, roll, pitch, yaw, strict=True)
    ]
    return _rows("| rad/s | roll over pitch | phase | yaw over pitch | phase |", rows)
