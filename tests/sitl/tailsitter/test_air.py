"""Wing, rotors, battery and flexible modes, each against what must hold for any of its kind."""

from math import cos, pi, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.tailsitter.battery import battery
from sitl.tailsitter.flexible import flex
from sitl.tailsitter.layout import INERTIA, MODE, MODE_RATE, OUTPUTS, PICKUP, STATES, SUMS, TORQUE_SUM
from sitl.tailsitter.parameters import Parameters, table
from sitl.tailsitter.rotors import coefficient, ground_factor, slipstream, wall_factor
from sitl.tailsitter.wing import panel

P = Parameters()
R = P.record()[0]
PRESSURE = 0.5 * P.air_density * 100.0 * P.panel_area  # at 10 m/s

angle = st.floats(-pi, pi)
unhurried = settings(deadline=None)  # the first call compiles


def at(alpha: float, speed: float = 10.0) -> tuple[float, float, float]:
    return panel(speed * sin(alpha), speed * cos(alpha), R)


@unhurried
@given(angle)
def test_the_wing_is_symmetrical_about_its_chord(alpha):
    cross, along, behind = at(alpha)
    other = at(-alpha)
    assert other[0] == pytest.approx(-cross, abs=1e-9)
    assert other[1:] == pytest.approx((along, behind), abs=1e-9)


@unhurried
@given(angle)
def test_the_wing_never_pushes_the_way_it_flies(alpha):
    cross, along, _ = at(alpha)
    assert cross * sin(alpha) + along * cos(alpha) < 0.0


@unhurried
@given(angle, st.floats(0.1, 30.0))
def test_force_grows_with_the_square_of_speed(alpha, speed):
    one, other = at(alpha), at(alpha, speed)
    assert other[:2] == pytest.approx([v * (speed / 10.0) ** 2 for v in one[:2]], abs=1e-9)


def test_the_wing_is_continuous_all_the_way_round():
    forces = np.array([at(a) for a in np.linspace(-pi, pi, 20_001)])
    assert np.abs(np.diff(forces[:, :2], axis=0)).max() < 2e-3 * PRESSURE
    assert np.abs(forces[0] - forces[-1]).max() < 1e-9


def test_lift_slope_stall_and_plate_are_those_of_the_table():
    cross, _, behind = at(radians(1.0))
    assert -cross / PRESSURE / radians(1.0) == pytest.approx(P.lift_slope, rel=0.02)
    assert behind < 1e-4 * P.chord
    cross, along, behind = at(pi / 2)
    assert (-cross / PRESSURE, along) == pytest.approx((P.plate_drag, 0.0), abs=1e-4)
    assert behind == pytest.approx(0.25 * P.chord, rel=1e-4)  # a plate's force is in its middle
    lift = [-at(radians(a))[0] * cos(radians(a)) + at(radians(a))[1] * sin(radians(a)) for a in range(5, 40)]
    assert 17 <= 5 + int(np.argmax(lift)) <= 30


def test_still_air_does_nothing():
    assert panel(0.0, 0.0, R) == (0.0, 0.0, 0.0)


def test_thrust_is_lost_with_speed_along_the_axis_and_gone_at_the_advance_ratio_named():
    speed, radius = 700.0, P.rotor_radius
    still = coefficient(speed, 0.0, radius, P.zero_thrust_advance)
    assert still == speed**2
    gone = P.zero_thrust_advance * speed * 2.0 * radius / (2.0 * pi)
    assert coefficient(speed, gone, radius, P.zero_thrust_advance) == pytest.approx(0.0, abs=1e-6)
    assert coefficient(speed, 2.0, radius, P.zero_torque_advance) > coefficient(
        speed, 2.0, radius, P.zero_thrust_advance
    )


def test_ground_lifts_and_a_wall_takes_and_far_away_neither_does():
    heights = np.linspace(0.1, 5.0, 50)
    ground = np.array([ground_factor(h, R) for h in heights])
    wall = np.array([wall_factor(h, R) for h in heights])
    assert (np.diff(ground) <= 0.0).all()
    assert (np.diff(wall) >= 0.0).all()
    assert 1.05 < ground[2] < 2.0
    assert ground[-1] == pytest.approx(1.0, abs=2e-3)
    assert wall[-1] == pytest.approx(1.0, abs=1e-3)


def test_the_slipstream_carries_the_momentum_of_the_thrust():
    full = P.slipstream_share * P.slipstream_growth
    induced = slipstream(4.0, 0.0, R) / full
    area = pi * P.rotor_radius**2
    assert 2.0 * P.air_density * area * induced**2 == pytest.approx(4.0)
    climbing = slipstream(4.0, 5.0, R) / full
    assert 2.0 * P.air_density * area * (5.0 + climbing) * climbing == pytest.approx(4.0)


@unhurried
@given(st.floats(0.0, 1.0), st.floats(0.0, 800.0))
def test_the_battery_gives_the_power_that_is_taken(charge, power):
    share, current = battery(charge, power, R)
    voltage = share * P.cells * P.cell_full
    assert 0.0 < share <= 1.0
    assert voltage * current == pytest.approx(power / P.drive_efficiency)
    resting = P.cells * (P.cell_empty + (P.cell_full - P.cell_empty) * charge)
    assert voltage + P.battery_resistance * current == pytest.approx(resting)


def test_more_power_and_less_charge_mean_less_voltage():
    assert battery(1.0, 0.0, R)[0] == 1.0
    assert battery(1.0, 300.0, R)[0] < battery(1.0, 100.0, R)[0]
    assert battery(0.2, 100.0, R)[0] < battery(0.9, 100.0, R)[0]


def test_a_flexible_mode_is_the_damped_oscillator_it_names():
    x, dx, out, sums = np.zeros(STATES), np.zeros(STATES), np.zeros(OUTPUTS), np.zeros(SUMS)
    sums[INERTIA : INERTIA + 3], sums[TORQUE_SUM + 1] = P.inertia, 5.0 * P.inertia[1]
    x[MODE], x[MODE_RATE] = 0.3, 2.0
    flex(x, dx, out, sums, R)
    w = P.mode_frequency[0]
    assert dx[MODE] == 2.0
    assert dx[MODE_RATE] == pytest.approx(5.0 * P.mode_pitch[0] - 2.0 * P.mode_damping * w * 2.0 - w * w * 0.3)
    pickup = [P.mode_roll[0] * 2.0, P.mode_pitch[0] * 2.0, P.mode_yaw[0] * 2.0]
    assert out[PICKUP : PICKUP + 3].tolist() == pickup


def test_every_parameter_is_in_the_table_with_unit_meaning_and_source():
    rows = table().splitlines()[2:]
    assert len(rows) == len(P.record().dtype.names)
    for row in rows:
        assert all(cell.strip() for cell in row.strip("|").split("|")), row
