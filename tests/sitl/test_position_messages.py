"""Where the vehicle is, as its messages say it."""

from math import isclose

from sitl.autopilot.aircraft import Aircraft, tailsitter
from sitl.flight import Flight
from sitl.scenario.spec import load
from sitl.wire.messages import BUILDERS, HOME_LAT, HOME_LON

GLOBAL_POSITION_INT, LOCAL_POSITION_NED, SERVO_OUTPUT_RAW = 33, 32, 36


def flown(aircraft: Aircraft, samples: int = 10) -> Flight:
    flight = Flight(load("calm"), 1, aircraft=aircraft)
    for _ in range(samples):
        flight.step()
    return flight


def message(flight: Flight, number: int):
    return BUILDERS[number](flight.vehicle, flight.newest)


def test_a_vehicle_100_m_north_east_of_home_says_so():
    flight = flown(tailsitter())
    airframe = flight.vehicle.airframe
    airframe.position, airframe.velocity = (100.0, 100.0, -20.0), (1.0, -2.0, 3.0)
    here = message(flight, GLOBAL_POSITION_INT)
    assert isclose((here.lat - HOME_LAT) * 1e-7 * 111_195.0, 100.0, abs_tol=0.02)
    assert isclose((here.lon - HOME_LON) * 1e-7 * 111_195.0 * 0.92496, 100.0, abs_tol=0.02)  # cosine of 22.3364°
    assert (here.relative_alt, here.vx, here.vy, here.vz) == (20_000, 100, -200, 300)
    local = message(flight, LOCAL_POSITION_NED)
    assert (local.x, local.y, local.z, local.vx, local.vy, local.vz) == (100.0, 100.0, -20.0, 1.0, -2.0, 3.0)


def test_the_motors_shown_are_those_that_the_mixer_commands():
    flight = flown(tailsitter(), 500)
    sample, shown = flight.newest, message(flight, SERVO_OUTPUT_RAW)
    assert flight.vehicle.flying
    expected = [1000 + round(1000.0 * each) for each in flight.vehicle.mixer.commands(sample.u_e, sample.thrust)]
    assert [shown.servo1_raw, shown.servo2_raw, shown.servo3_raw, shown.servo4_raw] == expected
    assert 1000 < min(expected) < max(expected) <= 2000
