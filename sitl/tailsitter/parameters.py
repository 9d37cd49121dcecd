"""Every number of the tail-sitter, with its unit and where it comes from.

Sources, by the names used below:

PX4 model
    PX4-gazebo-models, models/quadtailsitter/model.sdf: a published quadrotor tail-sitter (after the HEQ Swan K1), used
    because the paper's references [18]–[22] print no complete set of numbers.
aero.hpp
    PX4-Autopilot, src/modules/simulation/simulator_sih/aero.hpp, after W. Khan, Dynamics modeling of agile fixed-wing
    unmanned aerial vehicles, PhD thesis, McGill University, 2016, chapter 3.
Beard and McLain
    Small Unmanned Aircraft: Theory and Practice, Princeton, 2012, section 4.2: the blend of a linear wing and a plate.
Sanchez-Cuevas
    P. Sanchez-Cuevas, G. Heredia, A. Ollero, Characterization of the aerodynamic ground effect and its influence in
    multirotor control, Int. J. of Aerospace Engineering 2017, 1823056, after Cheeseman and Bennett, ARC R&M 3021, 1955.
(11)
    The paper's identified pitch model; a number marked so is chosen that the model's linearization in hover is (11).
guess
    Nobody's measurement; the reason stands beside it.
"""

from dataclasses import dataclass, fields
from math import cos, sin
from typing import Annotated, NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray

Three = tuple[float, float, float]
Four = tuple[float, float, float, float]

_LEAN, _UP = sin(0.28), cos(0.28)


class Of(NamedTuple):
    """What a number is: its unit, its meaning and its source."""

    unit: str
    meaning: str
    source: str


@dataclass(frozen=True, slots=True)
class Parameters:
    """The airframe in numbers; hover axes, origin in the centre of mass. `dataclasses.replace` makes another one."""

    # Body
    mass: Annotated[float, Of("kg", "mass without payload", "PX4 model")] = 1.6
    inertia: Annotated[
        Three,
        Of(
            "kg m²",
            "principal moments about roll, pitch, yaw",
            "guess: 4 × 45 g of motor and propeller at their hubs, 0.3 kg of wing, 1.1 kg within ±50 mm; "
            "the PX4 model's are those of a box without its mass as a factor",
        ),
    ] = (0.033, 0.0072, 0.0355)
    gravity: Annotated[float, Of("m/s²", "standard gravity", "ISO 80000-3")] = 9.80665
    air_density: Annotated[float, Of("kg/m³", "air density", "ISA at sea level")] = 1.225
    leg: Annotated[float, Of("m", "height of the centre of mass when it stands", "guess: chord and landing gear")] = (
        0.30
    )
    payload_arm: Annotated[float, Of("m", "payload below the centre of mass", "guess: under the trailing edge")] = 0.15
    side_area: Annotated[
        float, Of("m²", "drag area C_D·A against wind along the span", "guess: a 0.1 m × 0.2 m fuselage")
    ] = 0.02

    # Rotors: front right, rear left, front left, rear right, seen from above with the belly to the front
    rotor_x: Annotated[Four, Of("m", "hubs, towards the belly", "PX4 model")] = (0.145, -0.145, 0.145, -0.145)
    rotor_y: Annotated[Four, Of("m", "hubs, along the span", "PX4 model")] = (0.23, -0.23, -0.23, 0.23)
    rotor_z: Annotated[float, Of("m", "hubs below the centre of mass", "PX4 model: 10 mm above it, rounded")] = 0.0
    axis_x: Annotated[
        Four,
        Of(
            "1",
            "thrust axes, canted by 0.28 rad towards the wing: yaw authority",
            "the yaw torque of the PX4 model, which cants by 0.17 rad towards the wing and outwards; the outward cant "
            "would delay pitch by 4 ms, by the reaction of the rotors' inertia, and (11) shows no such delay",
        ),
    ] = (-_LEAN, _LEAN, -_LEAN, _LEAN)
    axis_z: Annotated[float, Of("1", "thrust axes, upwards", "follows")] = -_UP
    spin: Annotated[Four, Of("1", "+1 counter-clockwise from above", "PX4 model")] = (1.0, 1.0, -1.0, -1.0)
    rotor_radius: Annotated[
        float, Of("m", "propeller of 9 inches", "guess: gives C_T = 0.10 with the thrust constant")
    ] = 0.114
    thrust_constant: Annotated[float, Of("N s²", "static thrust over speed squared", "PX4 model, motorConstant")] = (
        8.54858e-6
    )
    top_speed: Annotated[float, Of("rad/s", "full battery, full command", "PX4 model, maxRotVelocity")] = 1200.0
    idle: Annotated[
        float, Of("1", "least command of a turning rotor, share of full thrust", "guess: 14 % of top speed")
    ] = 0.02
    rotor_lag: Annotated[float, Of("s", "speed behind its command", "(11): pole 0.9447 = exp(-0.004 / 0.0704)")] = (
        0.0704
    )
    torque_arm: Annotated[
        float,
        Of("m", "drag torque over thrust", "guess: C_P / (2π C_T) · D with C_P / C_T = 0.45, slow-fly propellers"),
    ] = 0.0165
    zero_thrust_advance: Annotated[
        float, Of("1", "advance ratio J = 2πV/(ωD) without thrust", "guess: UIUC data of 9×4.7 propellers, roughly")
    ] = 0.70
    zero_torque_advance: Annotated[float, Of("1", "advance ratio without torque", "guess: the same propellers")] = 1.1
    rotor_inertia: Annotated[float, Of("kg m²", "propeller and bell", "guess: 8 g · D²/12, doubled for the bell")] = (
        3.5e-5
    )
    rotor_drag: Annotated[float, Of("N s²/m", "in-plane drag per speed and air speed", "PX4 model")] = 8.06428e-5
    delay: Annotated[
        float, Of("s", "from the gyro sample to the speed controllers' new command", "(11): its zero at -1.716")
    ] = 0.00053
    mixer_share: Annotated[
        float, Of("1", "change of thrust per rotor asked for by a torque of 1, share of full thrust", "(11): its gain")
    ] = 1.822
    ground_spacing: Annotated[float, Of("m", "between neighbouring rotors, for ground effect", "mean of two sides")] = (
        0.375
    )
    ground_fountain: Annotated[float, Of("1", "fountain coefficient K_b of ground effect", "Sanchez-Cuevas")] = 2.0
    wall_loss: Annotated[
        float, Of("1", "thrust lost near a wall over (radius/distance)²", "guess: 3 % at two radii")
    ] = 0.12

    # Wing: four panels across the span, the two inner ones near the propellers
    panel_y: Annotated[Four, Of("m", "panel centres", "guess: 0.9 m of span in quarters")] = (
        0.3375,
        -0.3375,
        0.1125,
        -0.1125,
    )
    panel_area: Annotated[float, Of("m²", "of one panel", "follows: 0.225 m × chord")] = 0.0495
    chord: Annotated[float, Of("m", "mean aerodynamic chord", "PX4 model")] = 0.22
    wing_z: Annotated[
        float, Of("m", "quarter chord below the centre of mass", "(11): a hover without static moment; 9 % of chord")
    ] = 0.0205
    blown: Annotated[Four, Of("1", "panels in a slipstream", "guess: propellers beside the inner half")] = (
        0.0,
        0.0,
        1.0,
        1.0,
    )
    slipstream_share: Annotated[
        float,
        Of("1", "part of the slipstream that reaches the wing", "guess: the tubes pass 31 mm beside it and spread"),
    ] = 0.5
    slipstream_growth: Annotated[
        float, Of("1", "slipstream at the wing over induced velocity", "1 + s/√(s²+R²) at s = R; McCormick, by Khan")
    ] = 1.7
    lift_slope: Annotated[float, Of("1/rad", "of a plate of aspect ratio 4.1", "aero.hpp, kp")] = 3.81
    plate_drag: Annotated[float, Of("1", "drag across the plate, C_D90", "aero.hpp")] = 1.98
    skin_drag: Annotated[float, Of("1", "drag along the plate, C_D0", "aero.hpp")] = 0.04
    suction: Annotated[
        float, Of("1", "leading-edge suction kept", "1 - kp / (π · 0.87 · 4.1): induced drag of aero.hpp")
    ] = 0.66
    stall: Annotated[float, Of("1", "sine of the stall angle, 24°", "aero.hpp, afs at aspect ratio 4")] = 0.407
    stall_rate: Annotated[
        float, Of("1", "steepness of the blend from wing to plate", "Beard and McLain; 10° of aero.hpp")
    ] = 23.0

    # Flexible modes; each column of `mode_*` belongs to one mode
    mode_frequency: Annotated[
        Three, Of("rad/s", "natural frequencies", "guess: three between 50 and 600 rad/s, as in Fig. 6")
    ] = (140.0, 260.0, 450.0)
    mode_damping: Annotated[float, Of("1", "damping ratio", "guess: glued foam and carbon tubes")] = 0.03
    mode_roll: Annotated[Three, Of("1", "participation of roll", "guess")] = (0.25, 0.0, 0.25)
    mode_pitch: Annotated[
        Three, Of("1", "participation of pitch", "guess: resonances up to 1.9 times the rigid body, as Fig. 6 suggests")
    ] = (0.25, 0.30, 0.35)
    mode_yaw: Annotated[Three, Of("1", "participation of yaw", "guess")] = (0.0, 0.30, 0.0)

    # Battery
    cells: Annotated[float, Of("1", "cells in series", "guess: usual with such propellers")] = 4.0
    cell_full: Annotated[float, Of("V", "open-circuit voltage of a full cell", "lithium polymer")] = 4.2
    cell_empty: Annotated[
        float, Of("V", "open-circuit voltage of an empty cell", "lithium polymer, linear in between")
    ] = 3.5
    battery_resistance: Annotated[float, Of("Ω", "internal resistance", "guess: 5 mΩ a cell and 10 mΩ of wires")] = 0.03
    battery_capacity: Annotated[float, Of("C", "capacity, 4 Ah", "guess")] = 14400.0
    drive_efficiency: Annotated[float, Of("1", "shaft power over battery power", "guess")] = 0.75

    @property
    def full_thrust(self) -> float:
        """Thrust of one rotor at full command, N."""
        return self.thrust_constant * self.top_speed**2

    def record(self) -> NDArray[np.void]:
        """The same numbers as one structured row, for the compiled functions; shape (1,)."""
        kinds = [(f.name, np.float64, np.shape(getattr(self, f.name))) for f in fields(self)]
        return np.array([tuple(getattr(self, f.name) for f in fields(self))], dtype=kinds)


def table() -> str:
    """Every parameter as a Markdown table: name, value, unit, meaning, source."""
    lines = ["| name | value | unit | meaning | source |", "| --- | --- | --- | --- | --- |"]
    kinds = get_type_hints(Parameters, include_extras=True)
    for f in fields(Parameters):
        (of,) = kinds[f.name].__metadata__
        value = f.default if isinstance(f.default, tuple) else (f.default,)
        shown = ", ".join(f"{v:.4g}" for v in value)
        lines.append(f"| `{f.name}` | {shown} | {of.unit} | {of.meaning} | {of.source} |")
    return "\n".join(lines)
