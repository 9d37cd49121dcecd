"""The rigid body against conservation laws, and the integrator against its order."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sitl.tailsitter.body import derivative, sample, step, workspace
from sitl.tailsitter.layout import (
    ACCELERATION,
    CHARGE_AT_START,
    COMMAND,
    EFFECTIVENESS,
    GAIN,
    HELD,
    INPUTS,
    MOMENT,
    OUTPUTS,
    PAYLOAD,
    POSITION,
    QUATERNION,
    RATE,
    ROTOR,
    STATES,
    SUMS,
    VELOCITY,
    WALL,
)
from sitl.tailsitter.parameters import Parameters

P = Parameters()
NOTHING = replace(P, thrust_constant=0.0, panel_area=0.0, side_area=0.0, rotor_drag=0.0, gravity=0.0)


def tumbling(height: float = 50.0) -> np.ndarray:
    x = np.zeros(STATES)
    x[POSITION + 2] = -height
    x[VELOCITY : VELOCITY + 3] = 3.0, -1.0, -2.0
    x[QUATERNION : QUATERNION + 4] = np.array([0.8, 0.3, -0.4, 0.2]) / np.linalg.norm([0.8, 0.3, -0.4, 0.2])
    x[RATE : RATE + 3] = 4.0, -7.0, 3.0
    return x


def inputs(command: float = 0.0) -> np.ndarray:
    u = np.zeros(INPUTS)
    u[COMMAND : COMMAND + 4] = command
    u[WALL], u[HELD], u[CHARGE_AT_START] = inf, -1.0, 1.0
    u[EFFECTIVENESS : EFFECTIVENESS + 4] = u[GAIN : GAIN + 3] = 1.0
    return u


def flown(p: Parameters, x: np.ndarray, u: np.ndarray, seconds: float, h: float = 0.001) -> np.ndarray:
    x, record, work, out = x.copy(), p.record()[0], workspace(), np.zeros(OUTPUTS)
    for _ in range(round(seconds / h)):
        step(x, u, record, h, work, out)
    return x


def turned(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A vector of the body in north-east-down."""
    w, a, b, c = x[QUATERNION : QUATERNION + 4]
    return Rotation.from_quat([a, b, c, w]).apply(v)


def angular_momentum(p: Parameters, x: np.ndarray) -> np.ndarray:
    h = p.rotor_inertia * np.array(p.spin) * x[ROTOR : ROTOR + 4]
    rotors = np.array([h @ np.array(p.axis_x), 0.0, h.sum() * p.axis_z])
    return turned(x, np.array(p.inertia) * x[RATE : RATE + 3] + rotors)


def energy(p: Parameters, x: np.ndarray) -> float:
    v, w = x[VELOCITY : VELOCITY + 3], x[RATE : RATE + 3]
    return 0.5 * p.mass * v @ v + 0.5 * w @ (np.array(p.inertia) * w) - p.mass * p.gravity * x[POSITION + 2]


def test_with_no_force_it_flies_straight_on_and_keeps_its_energy():
    x = tumbling()
    after = flown(NOTHING, x, inputs(), 2.0)
    np.testing.assert_allclose(after[VELOCITY : VELOCITY + 3], x[VELOCITY : VELOCITY + 3], rtol=1e-14)
    np.testing.assert_allclose(after[:3], x[:3] + 2.0 * x[VELOCITY : VELOCITY + 3], rtol=1e-12)
    assert energy(NOTHING, after) == pytest.approx(energy(NOTHING, x), rel=1e-9)
    assert not np.allclose(after[RATE : RATE + 3], x[RATE : RATE + 3], atol=0.1)  # it does tumble


def test_gravity_alone_keeps_the_sum_of_kinetic_and_potential_energy():
    falling = replace(NOTHING, gravity=9.80665)
    x = tumbling()
    after = flown(falling, x, inputs(), 2.0)
    assert after[POSITION + 2] == pytest.approx(x[POSITION + 2] - 4.0 + 0.5 * 9.80665 * 4.0)
    assert energy(falling, after) == pytest.approx(energy(falling, x), rel=1e-9)


def test_rotors_that_spin_up_pass_their_angular_momentum_to_the_body():
    x = tumbling()
    x[ROTOR : ROTOR + 4] = 200.0, 500.0, 900.0, 100.0
    u = inputs()
    u[COMMAND : COMMAND + 4] = 0.9, 0.2, 0.0, 0.6
    after = flown(NOTHING, x, u, 0.5, 0.0005)
    assert abs(after[ROTOR] - x[ROTOR]) > 100.0
    np.testing.assert_allclose(angular_momentum(NOTHING, after), angular_momentum(NOTHING, x), rtol=1e-8, atol=1e-10)


def test_the_quaternion_stays_a_unit_quaternion():
    x = flown(P, tumbling(), inputs(0.4), 5.0)
    assert np.linalg.norm(x[QUATERNION : QUATERNION + 4]) == pytest.approx(1.0, abs=1e-15)
    assert np.isfinite(x).all()


def test_drag_takes_energy_away():
    still = replace(P, gravity=0.0)
    before = tumbling()
    energies = [
        energy(still, x) for x in (before, flown(still, before, inputs(), 0.5), flown(still, before, inputs(), 1.0))
    ]
    assert energies[0] > energies[1] > energies[2] > 0.0


def test_the_integrator_is_of_fourth_order():
    u = inputs(0.35)
    u[MOMENT : MOMENT + 3] = 0.02, -0.01, 0.03
    x = tumbling()
    x[RATE : RATE + 3] = 1.0, -1.5, 0.5
    x[VELOCITY : VELOCITY + 3] = 2.0, -1.0, -6.0
    x[ROTOR : ROTOR + 4] = 600.0
    best = flown(P, x, u, 0.16, 0.0005)
    errors = [np.linalg.norm((flown(P, x, u, 0.16, h) - best)[VELOCITY:ROTOR]) for h in (0.016, 0.008, 0.004)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 3.7).all(), orders
    assert (orders < 4.5).all(), orders


def test_a_payload_adds_its_weight_and_swings_below():
    u, loaded = inputs(), inputs()
    loaded[PAYLOAD] = 0.4
    x, record, sums = np.zeros(STATES), NOTHING.record()[0], np.zeros(SUMS)
    x[QUATERNION] = 1.0
    rates, out = np.zeros((2, STATES)), np.zeros(OUTPUTS)
    for v, r in zip((u, loaded), rates, strict=True):
        v[MOMENT : MOMENT + 3] = 1.0
        derivative(x, v, record, sums, r, out)
    ix, iy, iz = P.inertia
    pair = P.mass * 0.4 / (P.mass + 0.4) * P.payload_arm**2  # reduced mass times distance squared
    np.testing.assert_allclose(rates[0, RATE : RATE + 3], [1 / ix, 1 / iy, 1 / iz])
    np.testing.assert_allclose(rates[1, RATE : RATE + 3], [1 / (ix + pair), 1 / (iy + pair), 1 / iz])


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_on_the_rod_one_axis_turns_and_nothing_else_moves(axis):
    u = inputs(0.3)
    u[HELD] = axis
    u[MOMENT : MOMENT + 3] = 0.05
    x = np.zeros(STATES)
    x[QUATERNION], x[POSITION + 2] = 1.0, -2.0
    after = flown(P, x, u, 0.2)
    assert after[:3].tolist() == x[:3].tolist()
    moving = np.abs(after[RATE : RATE + 3]) > 0.0
    assert moving.tolist() == [i == axis for i in range(3)]


def test_commands_reach_the_rotors_after_the_delay_and_not_before():
    x, work, out = np.zeros(STATES), workspace(), np.zeros(OUTPUTS)
    x[QUATERNION] = 1.0
    u, before, slow = inputs(0.25), np.zeros(7), replace(P, delay=0.001)
    sample(x, u, before, slow.record(), 0.004, 4, work, out)
    expected = 0.5 * P.top_speed * (1.0 - np.exp(-0.003 / P.rotor_lag))
    np.testing.assert_allclose(x[ROTOR : ROTOR + 4], expected, rtol=1e-8)
    assert before[:4].tolist() == [0.25] * 4


def test_a_lost_rotor_pulls_to_its_side_and_half_a_gain_halves_the_torque():
    x, record, sums, out = np.zeros(STATES), P.record()[0], np.zeros(SUMS), np.zeros(OUTPUTS)
    x[QUATERNION], x[POSITION + 2] = 1.0, -20.0
    x[ROTOR : ROTOR + 4] = 690.0
    lost, half = inputs(), inputs()
    lost[EFFECTIVENESS] = half[EFFECTIVENESS] = 0.0
    half[GAIN : GAIN + 3] = 0.5
    rates = np.zeros((2, STATES))
    derivative(x, lost, record, sums, rates[0], out)
    assert rates[0, RATE] > 0.0  # front right is gone: the right side falls
    assert rates[0, RATE + 1] < 0.0  # and so does the front
    assert out[ACCELERATION + 2] > 0.0
    derivative(x, half, record, sums, rates[1], out)
    assert rates[1, RATE] == pytest.approx(0.5 * rates[0, RATE], rel=1e-6)
