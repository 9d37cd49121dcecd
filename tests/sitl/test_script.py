"""The flight's script, run in process with a companion that answers at once."""

import dataclasses

import numpy as np
import pytest

from sitl.errors import FlightFailedError
from sitl.flight import Flight
from sitl.result import summarize
from sitl.scenario.script import Phase
from sitl.scenario.spec import load
from tests.sitl.bench import short_scenario

SCALE = (0.1, 0.06, 0.17)


@pytest.fixture
def short(tmp_path):
    return load(short_scenario(tmp_path))


def fly_until(flight: Flight, phase: Phase, limit: int = 20000) -> list[str]:
    notices = []
    for _ in range(limit):
        if flight.script.phase is phase:
            return notices
        sample, texts = flight.step()
        flight.answer(sample.stamp_us, (0.0, 0.0, 0.0))
        notices += texts
    raise AssertionError(f"{phase} not reached, still in {flight.script.phase}")


def test_a_whole_flight_goes_through_its_notices_in_order(short):
    flight = Flight(short, 1, SCALE)
    notices = fly_until(flight, Phase.WAIT_OBSERVER)
    assert flight.script.awaiting == "DOB_ENABLE=1"
    flight.script.observer_reported(True)
    notices += fly_until(flight, Phase.COMPLETE)
    assert notices == ["hover reached", "window off", "window on"]
    assert flight.complete


def test_both_windows_have_the_same_length_disturbance_and_noise(short):
    flight = Flight(short, 1, SCALE)
    fly_until(flight, Phase.WAIT_OBSERVER)
    for _ in range(77):  # in real time the flight goes on while the switch is awaited
        flight.step()
    flight.script.observer_reported(True)
    fly_until(flight, Phase.COMPLETE)
    a = flight.log.arrays()
    off, on = a["window"] == 1, a["window"] == 2
    assert off.sum() == on.sum() == 250
    np.testing.assert_array_equal(a["disturbance"][off], a["disturbance"][on])
    noise = a["gyro"] - a["rate"]
    np.testing.assert_allclose(noise[off], noise[on], atol=5e-7)  # single precision of the gyro
    assert np.ptp(a["disturbance"][off], axis=0).min() > 0.0


def test_the_air_stays_rough_while_the_switch_is_awaited_and_is_still_before_the_second_segment(short):
    flight = Flight(short, 1, SCALE)
    fly_until(flight, Phase.WAIT_OBSERVER)
    waiting = [flight.step()[0].disturbance for _ in range(20)]
    assert all(any(d) for d in waiting)
    flight.script.observer_reported(True)
    assert flight.script.phase is Phase.SETTLE
    still = [flight.step()[0].disturbance for _ in range(50)]
    assert set(still) == {(0.0, 0.0, 0.0)}
    assert flight.script.phase is Phase.ON


def test_in_truth_and_in_the_log_the_disturbance_adds_at_the_plant_input(short):
    flight = Flight(short, 1, SCALE)
    fly_until(flight, Phase.WAIT_OBSERVER)
    a = flight.log.arrays()
    air = a["disturbance"].any(axis=1)
    v, y = (a["u_e"] + a["disturbance"])[air], a["rate"][air]
    b1, b2, p = 0.14131, 0.14131 * 1.716, 0.9447
    expected = (1 + p) * y[1:-1, 1] - p * y[:-2, 1] + b1 * v[1:-1, 1] + b2 * v[:-2, 1]
    np.testing.assert_allclose(y[2:, 1], expected, atol=1e-12)


def test_an_observer_enabled_before_the_window_off_spoils_the_flight(short):
    flight = Flight(short, 1, SCALE)
    fly_until(flight, Phase.CLIMB)
    flight.script.observer_reported(True)
    with pytest.raises(FlightFailedError, match="DOB_ENABLE is already 1"):
        fly_until(flight, Phase.WAIT_OBSERVER)


def test_an_observer_enabled_in_the_window_off_spoils_the_flight(short):
    flight = Flight(short, 1, SCALE)
    fly_until(flight, Phase.OFF)
    with pytest.raises(FlightFailedError, match="DOB_ENABLE became 1"):
        flight.script.observer_reported(True)


def test_an_observer_switched_off_in_the_window_on_spoils_the_flight(short):
    flight = Flight(short, 1, SCALE)
    fly_until(flight, Phase.WAIT_OBSERVER)
    flight.script.observer_reported(True)
    with pytest.raises(FlightFailedError, match="became 0"):
        flight.script.observer_reported(False)


def test_a_correction_in_the_window_off_spoils_the_flight(short):
    flight = Flight(short, 1, SCALE)
    fly_until(flight, Phase.OFF)
    flight.step()
    flight.answer(flight.vehicle.now_us, (0.0, 1e-6, 0.0))
    with pytest.raises(FlightFailedError, match="a correction acts"):
        flight.step()


def test_motors_stopped_in_flight_end_it(short):
    flight = Flight(short, 1, SCALE)
    fly_until(flight, Phase.OFF)
    flight.vehicle.disarm()
    with pytest.raises(FlightFailedError, match="came down"):
        fly_until(flight, Phase.WAIT_OBSERVER)


def test_in_still_air_a_landing_is_no_failure():
    flight = Flight(load("calm"), 1)
    fly_until(flight, Phase.HOVER)
    flight.vehicle.land()
    assert fly_until(flight, Phase.WAIT_ARM) == ["landed"]
    for _ in range(10):
        flight.step()
    assert not flight.vehicle.armed


def test_a_flight_that_awaits_arming_waits_for_arm_and_then_for_takeoff(short):
    flight = Flight(short, 1, await_arming=True)
    flight.step()
    assert flight.script.awaiting == "arm"
    flight.vehicle.arm()
    flight.script.poll()
    assert flight.script.awaiting == "takeoff"
    flight.vehicle.take_off(1.0)
    flight.script.poll()
    assert flight.script.phase is Phase.CLIMB


def test_the_result_holds_what_the_log_holds(short):
    flight = Flight(short, 3, SCALE)
    fly_until(flight, Phase.WAIT_OBSERVER)
    flight.script.observer_reported(True)
    unanswered = 0
    while not flight.complete:
        in_window = flight.script.window
        sample, _ = flight.step()
        if in_window and unanswered < 3:
            unanswered += 1
        else:
            flight.answer(sample.stamp_us, (0.0, 0.0, 0.0))
    arrays = flight.log.arrays()
    result = summarize(short, 3, "lockstep", arrays)
    assert (result["rate_hz"], result["delay_samples"], result["samples"]) == (250.0, 1, 500)
    assert result["samples_lost"] == 3
    assert [result["axes"][a]["paper_ratio"] for a in ("roll", "pitch", "yaw")] == [7.5, 12.0, 6.0]
    error = arrays["attitude_error"][arrays["window"] == 2][:, 1]
    pitch = result["axes"]["pitch"]
    assert pitch["rms_on"] == pytest.approx(np.std(error))
    assert pitch["peak_on"] == pytest.approx(np.abs(error - np.mean(error)).max())
    assert pitch["rms_ratio"] == pitch["rms_off"] / pitch["rms_on"]


def test_a_flight_in_process_repeats_itself_bit_by_bit(short):
    def fly() -> bytes:
        flight = Flight(dataclasses.replace(short), 4, SCALE)
        fly_until(flight, Phase.WAIT_OBSERVER)
        return b"".join(a.tobytes() for a in flight.log.arrays().values())

    assert fly() == fly()
