"""The whole vehicle: trim, the paper's pitch model, and flights from the ground and back to it."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sitl.airframe.surroundings import STILL, Surroundings
from sitl.attitude import ZERO, multiply
from sitl.autopilot.aircraft import tailsitter
from sitl.autopilot.correction import CorrectionInput
from sitl.autopilot.tuning import RATE_PIDS
from sitl.autopilot.vehicle import Sample, Vehicle
from sitl.constants import DT
from sitl.errors import FlightFailedError
from sitl.tailsitter.parameters import Parameters
from sitl.tailsitter.trim import linearize, trim
from sitl.weather.disturbance import SEGMENT, Weather

P = Parameters()
BAND = np.geomspace(4.0, 50.0, 24)  # where the paper identified (11), rad/s


def paper_pitch(w: np.ndarray) -> np.ndarray:
    z = np.exp(1j * w * DT)
    return 0.14131 * (z + 1.716) / ((z - 1.0) * (z - 0.9447))


def hovering(altitude: float = 5.0, **condition: object) -> Vehicle:
    vehicle = Vehicle(tailsitter())
    for name, value in condition.items():
        setattr(vehicle.airframe.condition, name, value)
    vehicle.arm()
    vehicle.take_off(altitude)
    fly(vehicle, 12.0)
    return vehicle


def fly(vehicle: Vehicle, seconds: float, around: Surroundings = STILL, noise: tuple = ZERO) -> list[Sample]:
    return [vehicle.step(around, noise, CorrectionInput()) for _ in range(round(seconds / DT))]


def test_in_still_air_it_hovers_upright_on_its_thrust_alone():
    still = trim(P)
    assert still.residual < 1e-9
    assert still.attitude == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=1e-9)
    assert still.torque == pytest.approx(ZERO, abs=1e-9)
    lift = 4.0 * still.thrust * P.full_thrust * abs(P.axis_z)
    assert lift == pytest.approx(P.mass * P.gravity, rel=0.01)  # the slipstream's drag on the wing is the rest
    assert lift > P.mass * P.gravity


@pytest.mark.parametrize("wind", [(5.0, 0.0, 0.0), (-8.0, 0.0, 0.0), (0.0, 8.0, 0.0), (4.0, -3.0, 0.0)])
def test_in_wind_it_leans_into_it(wind):
    leaning = trim(P, wind)
    assert leaning.residual < 1e-9
    w, x, y, _ = leaning.attitude
    north, east = -2.0 * w * y, 2.0 * w * x  # of the thrust's direction
    assert north * wind[0] <= 0.0
    assert east * wind[1] <= 0.0
    assert abs(north) + abs(east) > 0.02


def test_broadside_it_leans_and_works_far_more_than_edge_on():
    broadside, edge_on = trim(P, (6.0, 0.0, 0.0)), trim(P, (0.0, 6.0, 0.0))
    assert abs(broadside.attitude[2]) > 4.0 * abs(edge_on.attitude[1])
    assert abs(broadside.torque[1]) > 0.01 > 100.0 * abs(edge_on.torque[0])


def test_a_wind_too_strong_has_no_hover_and_says_so():
    with pytest.raises(FlightFailedError, match="no hover in a wind of"):
        trim(P, (15.0, 0.0, 0.0))


def test_pitch_in_hover_is_the_papers_model_within_one_percent_and_one_degree():
    ratio = linearize(P).response(BAND, 1) / paper_pitch(BAND)
    assert np.abs(np.abs(ratio) - 1.0).max() < 0.01
    assert np.abs(np.angle(ratio, deg=True)).max() < 1.0


def test_the_papers_zero_outside_the_unit_circle_is_half_a_millisecond_of_delay():
    prompt = linearize(replace(P, delay=0.0)).response(BAND, 1) / paper_pitch(BAND)
    assert np.angle(prompt[-1]) / BAND[-1] == pytest.approx(0.00053, abs=0.0001)


def test_roll_and_yaw_have_less_authority_than_pitch():
    hover = linearize(P)
    roll, pitch, yaw = (np.abs(hover.response(np.array([15.0]), axis))[0] for axis in range(3))
    assert 0.25 < roll / pitch < 0.45
    assert 0.05 < yaw / pitch < 0.25


def test_flexible_modes_stand_out_in_pitch_between_50_and_600_rad_s():
    w = np.geomspace(50.0, 600.0, 300)
    ratio = np.abs(linearize(P, flexible=True).response(w, 1) / linearize(P).response(w, 1))
    peaks = w[1:-1][(ratio[1:-1] > ratio[:-2]) & (ratio[1:-1] > ratio[2:]) & (ratio[1:-1] > 1.2)]
    np.testing.assert_allclose(peaks, P.mode_frequency, rtol=0.1)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("flexible", [False, True])
def test_every_attitude_loop_keeps_its_distance_from_instability(axis, flexible):
    w = np.geomspace(1.0, 780.0, 400)
    z, g = np.exp(1j * w * DT), RATE_PIDS[axis]
    controller = g.gain * (z - g.zeros[0]) * (z - g.zeros[1]) / (z * (z - 1.0))
    attitude = 1.0 + 6.5 * 0.5 * DT * (z + 1.0) / (z - 1.0)
    loop = linearize(P, flexible=flexible).response(w, axis) * controller * attitude
    assert np.abs(1.0 + loop).min() > 0.6


def test_it_takes_off_hovers_and_lands():
    vehicle = hovering(2.0)
    x, y, z = vehicle.airframe.position
    assert (x, y, z) == pytest.approx((0.0, 0.0, -2.0), abs=0.01)
    assert vehicle.airframe.specific_force == pytest.approx((0.0, 0.0, -9.80665), abs=0.01)
    vehicle.land()
    fly(vehicle, 8.0)
    assert not vehicle.armed
    assert not vehicle.flying
    assert vehicle.airframe.altitude == 0.0
    rest = fly(vehicle, 1.0)[-1]
    assert (rest.rate, rest.u_e) == (ZERO, ZERO)


@pytest.mark.parametrize("feed_forward", [False, True])
@pytest.mark.parametrize("wind", [(6.0, 2.0, 0.0), (-8.0, 0.0, 0.0)])
def test_it_holds_its_place_in_a_steady_wind_and_leans_as_the_trim_says(wind, feed_forward):
    vehicle = hovering()
    vehicle.hold.feed_forward = feed_forward
    fly(vehicle, 40.0, Surroundings(wind=wind))
    assert vehicle.airframe.position == pytest.approx((0.0, 0.0, -5.0), abs=0.05)
    assert vehicle.airframe.attitude == pytest.approx(trim(P, wind).attitude, abs=0.02)


def test_without_position_hold_the_wind_carries_it_away():
    vehicle = hovering()
    vehicle.position_hold = False
    fly(vehicle, 10.0, Surroundings(wind=(0.0, 5.0, 0.0)))
    assert vehicle.airframe.position[1] > 2.0


def test_a_lean_fed_forward_is_followed_with_a_fraction_of_the_error():
    plain, ahead = hovering(), hovering()
    ahead.hold.feed_forward = True
    largest = []
    for vehicle in (plain, ahead):
        vehicle.hold.point = (1.5, 1.0)
        errors = np.abs([s.attitude_error for s in fly(vehicle, 12.0)])
        largest.append(errors.max(axis=0))
        assert vehicle.airframe.position[:2] == pytest.approx((1.5, 1.0), abs=0.1)
    assert (largest[1][:2] < 0.25 * largest[0][:2]).all()


def test_the_pilots_step_is_not_fed_forward():
    vehicle = hovering()
    vehicle.hold.feed_forward = True
    vehicle.attitude_command = (np.cos(0.15), 0.0, 0.0, np.sin(0.15))
    step = fly(vehicle, 0.1)
    assert abs(step[0].attitude_error[2]) > 0.29
    for s in step:
        assert s.rate_setpoint == pytest.approx([-6.5 * e for e in s.attitude_error], abs=1e-3)


def test_the_pilots_heading_survives_position_hold():
    vehicle = hovering()
    vehicle.attitude_command = (np.cos(0.5), 0.0, 0.0, np.sin(0.5))
    fly(vehicle, 10.0)
    assert vehicle.airframe.attitude == pytest.approx(vehicle.attitude_command, abs=1e-3)
    assert vehicle.airframe.position[:2] == pytest.approx((0.0, 0.0), abs=0.1)


@pytest.mark.parametrize(
    "condition",
    [
        {"rotor_effectiveness": (0.7, 1.0, 1.0, 1.0)},
        {"payload_kg": 0.4},
        {"battery_sag": True, "battery_charge": 0.2},
        {"flexible": True},
        {"gain": (1.3, 0.7, 1.3)},
    ],
    ids=lambda c: next(iter(c)),
)
def test_it_hovers_whatever_has_become_of_it(condition):
    vehicle = hovering(**condition)
    last = fly(vehicle, 4.0)
    assert vehicle.airframe.position == pytest.approx((0.0, 0.0, -5.0), abs=0.15)
    assert np.abs([s.attitude_error for s in last]).max() < 0.01


def test_flexible_modes_leave_the_gyro_when_they_are_turned_off():
    vehicle = hovering(flexible=True)
    fly(vehicle, 0.1, Surroundings((0.0, 0.1, 0.0)))
    airframe = vehicle.airframe
    assert airframe.rate[1] != airframe.state[11]
    airframe.condition.flexible = False
    fly(vehicle, 0.1)
    assert airframe.rate == tuple(airframe.state[10:13])


def test_the_battery_empties_with_load_only_when_it_is_told_to():
    charges = [hovering(battery_sag=sag).airframe.state[26] for sag in (False, True)]
    assert charges[0] == 0.0
    assert 0.001 < charges[1] < 0.05


def test_a_disturbance_moves_it_as_much_as_the_linear_model_says():
    vehicle, push = hovering(), 0.01
    samples = fly(vehicle, 0.12, Surroundings((0.0, push, 0.0)))
    hover = linearize(P)
    x = np.zeros(len(hover.A))
    for s in samples:
        assert s.rate[1] == pytest.approx(hover.C[1] @ x, abs=2e-3)
        x = hover.A @ x + hover.B @ (np.array(s.u_e) + np.array(s.disturbance) - trim(P).torque)


def test_in_the_papers_disturbance_it_stays_in_the_air_and_on_the_spot():
    vehicle, weather = hovering(), Weather(1, 1.0, (0.037, 0.052, 0.044), 3.98e-4)
    weather.begin(SEGMENT)
    errors = []
    for _ in range(round(20.0 / DT)):
        d, n = weather.sample()
        errors.append(vehicle.step(Surroundings(d), n, CorrectionInput()).attitude_error)
    assert 0.05 < np.abs(errors).max() < 0.35
    assert np.linalg.norm(vehicle.airframe.position[:2]) < 1.0
    assert vehicle.airframe.altitude == pytest.approx(5.0, abs=0.5)


def test_on_the_rod_a_moment_turns_the_one_axis_and_release_flies_on():
    vehicle = hovering()
    where = vehicle.airframe.position
    vehicle.airframe.condition.held_axis = 0
    samples = fly(vehicle, 2.0, Surroundings(moment=(0.3, 0.3, 0.3)))
    assert max(abs(s.attitude_error[0]) for s in samples) > 5e-3
    assert all(s.rate[1:] == (0.0, 0.0) for s in samples[1:])
    assert vehicle.airframe.position == pytest.approx(where, abs=1e-3)
    vehicle.airframe.condition.held_axis = None
    fly(vehicle, 5.0)
    assert vehicle.airframe.altitude == pytest.approx(5.0, abs=0.1)


def test_a_wall_pulls_the_belly_towards_it():
    far, near = hovering(), hovering()
    fly(far, 2.0)
    fly(near, 2.0, Surroundings(wall_m=0.5))
    pitch = [fly(v, 0.1, a)[-1].u_e[1] for v, a in ((far, STILL), (near, Surroundings(wall_m=0.5)))]
    assert pitch[1] > pitch[0] + 1e-4  # the north rotors lose thrust; pitching up holds them


def test_turning_a_quarter_about_the_nose_turns_broadside_into_edge_on():
    quarter = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
    vehicle = hovering()
    vehicle.attitude_command = quarter
    fly(vehicle, 10.0)
    fly(vehicle, 25.0, Surroundings(wind=(0.0, 6.0, 0.0)))  # from the side that is now the belly's
    leaning = multiply(trim(P, (6.0, 0.0, 0.0)).attitude, (1.0, 0.0, 0.0, 0.0))
    assert abs(vehicle.airframe.attitude[0]) == pytest.approx(abs(leaning[0] * quarter[0]), abs=0.02)


PLAIN = """
from sitl.autopilot.correction import CorrectionInput
from sitl.airframe.surroundings import Surroundings
from sitl.autopilot.aircraft import tailsitter
from sitl.autopilot.vehicle import Vehicle
vehicle = Vehicle(tailsitter())
vehicle.airframe.condition.flexible = vehicle.airframe.condition.battery_sag = True
vehicle.arm()
vehicle.take_off(2.0)
around = Surroundings((0.05, -0.04, 0.03), (3.0, 2.0, 1.0), (0.1, 0.2, 0.3), (0.01, 0.02, 0.03), 1.5)
for _ in range(40):
    vehicle.step(around, (1e-4, 2e-4, 3e-4), CorrectionInput())
print(*vehicle.airframe.state.tolist())
"""


def test_compiled_and_plain_python_give_the_same_numbers():
    root = Path(__file__).parents[3]
    states = []
    for disabled in ("0", "1"):
        env = {**os.environ, "NUMBA_DISABLE_JIT": disabled, "PYTHONPATH": str(root)}
        text = subprocess.run(
            [sys.executable, "-c", PLAIN], env=env, capture_output=True, text=True, check=True, timeout=120
        ).stdout
        states.append([float(v) for v in text.split()])
    assert max(map(abs, states[0])) > 1.0
    np.testing.assert_allclose(states[0], states[1], rtol=1e-12, atol=1e-15)


def test_nothing_that_compiles_is_imported_until_a_tailsitter_flies():
    wanted = "[m for m in ('numba', 'scipy', 'sitl.tailsitter') if m in sys.modules]"
    code = f"import sys, sitl.flight, sitl.cli; print({wanted})"
    root = Path(__file__).parents[3]
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=root, timeout=30)
    assert out.stdout.strip() == "[]"
