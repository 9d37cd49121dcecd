"""Position and altitude hold against a body that does what they ask."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.attitude import LEVEL, ZERO, lean
from sitl.autopilot.aircraft import tailsitter
from sitl.autopilot.position import MAX_LEAN, AltitudeHold, PositionHold
from sitl.autopilot.tuning import PITCH_PID, Tuning
from sitl.constants import DT, GRAVITY

unhurried = settings(deadline=None)


def thrust_direction(q: tuple) -> tuple[float, float, float]:
    w, x, y, z = q
    return (-2.0 * (x * z + w * y), -2.0 * (y * z - w * x), -(1.0 - 2.0 * (x * x + y * y)))


@unhurried
@given(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0))
def test_a_lean_points_thrust_along_the_acceleration_asked_for(north, east):
    q = lean(north, east)
    n, e, d = thrust_direction(q)
    assert sum(v * v for v in q) == pytest.approx(1.0)
    assert (n / -d, e / -d) == pytest.approx((north / GRAVITY, east / GRAVITY), abs=1e-9)
    assert q[3] == 0.0


def test_at_its_point_and_at_rest_it_does_not_lean():
    assert PositionHold().step(ZERO, ZERO) == LEVEL


def test_it_leans_back_towards_its_point_and_never_too_far():
    hold = PositionHold()
    n, e, d = thrust_direction(hold.step((1000.0, -1000.0, -5.0), (10.0, -10.0, 0.0)))
    assert n < 0.0 < e
    assert (n * n + e * e) ** 0.5 / -d == pytest.approx(MAX_LEAN)


def test_a_steady_push_is_held_by_the_integral():
    hold, wind = PositionHold(), 2.0  # m/s² to the north
    position = velocity = 0.0
    for _ in range(round(40.0 / DT)):
        n, _, d = thrust_direction(hold.step((position, 0.0, -5.0), (velocity, 0.0, 0.0)))
        velocity += (GRAVITY * n / -d + wind) * DT
        position += velocity * DT
    assert (position, velocity) == pytest.approx((0.0, 0.0), abs=1e-3)


def test_a_new_point_is_flown_to():
    hold = PositionHold()
    hold.reset(3.0, -2.0)
    n, e, _ = thrust_direction(hold.step(ZERO, ZERO))
    assert n > 0.0 > e


def test_altitude_hold_carries_a_load_it_was_not_told_of():
    tuning = Tuning((PITCH_PID, PITCH_PID, PITCH_PID), hover_thrust=0.4, altitude_integral=0.8)
    hold, altitude, climb = AltitudeHold(tuning), 5.0, 0.0
    for _ in range(round(60.0 / DT)):
        thrust = hold.step(5.0, altitude, climb, 1.0)
        climb += (GRAVITY * thrust / 0.5 - GRAVITY) * DT  # it takes a half to hover now
        altitude += climb * DT
    assert (altitude, thrust) == pytest.approx((5.0, 0.5), abs=1e-3)


def test_the_tailsitter_can_be_carried_away_and_says_so():
    assert tailsitter().tuning.position_hold
