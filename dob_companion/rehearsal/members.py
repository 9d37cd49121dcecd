"""The aircraft that a rehearsal flies: the design's own, and those that its uncertainty says it may be. Pure."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dob_companion.artifact import DobDesign, StateSpaceData
from dob_companion.synthesis import Spec
from dob_companion.synthesis.robust.family import NOMINAL, family

SCHEMA = "dob-companion/aircraft/1"

NOISE_DBW = -68.0
"""Gyro noise where no spec says anything of it: σ = 3.98e-4 rad/s (the paper's Fig. 14)."""

PEAK_RAD = 0.05
"""Attitude error that the disturbance shall cause with the observer off: well within what is linear."""

SHARE_OF_LIMIT = 0.25
"""RMS of the disturbance over the largest correction, at most: its peaks are then within what may be corrected."""

LIMIT = 0.3
"""Largest correction of a design that states none: the default of DOB_LIMIT."""

LEAST_REST_S, LONGEST_REST_S, REST_IN_MODES = 4.0, 20.0, 3.0
"""Still air between the windows, s: three time constants of the slowest loop."""


@dataclass(frozen=True, slots=True)
class Member:
    """One aircraft of the family: its name, in words what is changed about each axis, and its aircraft file."""

    name: str
    changed: Mapping[str, str]
    aircraft: Mapping[str, Any]


def members(design: DobDesign, attitude_gain: Mapping[str, float]) -> list[Member]:
    """The model first; every block at the same end of its family, and as designed for where it has no such end.

    `attitude_gain` (1/s, by axis) is the same for all: the autopilot does not know which of them it flies.
    """
    families = [family(block, design.dt) for block in design.blocks]
    names = dict.fromkeys(each.name for one in families for each in one)
    found = []
    for name in names:
        chosen = [next((each for each in one if each.name == name), one[0]) for one in families]
        blocks = [
            {
                "axes": list(block.axes),
                "problem": {"plant": _matrices(each.plant), "controller": _matrices(block.problem.controller)},
            }
            for block, each in zip(design.blocks, chosen, strict=True)
        ]
        changed = {
            axis: words
            for block, each in zip(design.blocks, chosen, strict=True)
            for axis, words in zip(block.axes, each.changed, strict=True)
        }
        aircraft = {
            "schema": SCHEMA,
            "dt": design.dt,
            "delay_samples": design.delay_samples,
            "attitude_gain": dict(attitude_gain),
            "blocks": blocks,
        }
        found.append(Member(name, changed, aircraft))
    return found


def uncertain(flown: list[Member]) -> bool:
    """Whether there is more than the model."""
    return any(member.name != NOMINAL for member in flown)


def scenario_text(design: DobDesign, spec: Spec | None) -> str:
    """The scenario of a rehearsal: a hover in noise, off and on, as the spec's [auto] table has its weather."""
    auto = spec.auto if spec else None
    noise = 20.0 * math.log10(auto.noise_rms) if auto else NOISE_DBW
    corner = auto.corner_hz or auto.high_hz if auto else 1.0
    largest = SHARE_OF_LIMIT * (design.limit or LIMIT)
    return f"""\
title = "Rehearsal: hover in a disturbance, observer off and on"
hover_altitude_m = 2.0

[gyro]
noise_dbw = {max(-300.0, min(0.0, noise)):.6g}

[disturbance]
bandwidth_hz = {max(1e-3, min(100.0, corner)):.6g}
peak_attitude_error_rad = {{ roll = {PEAK_RAD}, pitch = {PEAK_RAD}, yaw = {PEAK_RAD} }}
largest_rms = {largest:.6g}

[windows]
lead_s = 1.0
length_s = 8.0
settle_s = {_rest_s(design):.3g}
"""


def _rest_s(design: DobDesign) -> float:
    slowest = max(block.certificate.closed_loop_spectral_radius for block in design.blocks)
    lasting = REST_IN_MODES * -design.dt / math.log(slowest) if 0.0 < slowest < 1.0 else 0.0
    return max(LEAST_REST_S, min(LONGEST_REST_S, lasting))


def _matrices(system: StateSpaceData) -> dict[str, Any]:
    return {name: getattr(system, name).tolist() for name in "ABCD"}
