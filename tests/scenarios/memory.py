"""Scenarios flown with vehicle and companion in one process: the wire without sockets, or no wire at all."""

from pymavlink.dialects.v20 import common as mav

from dob_companion.artifact import DobDesign
from dob_companion.companion import Companion
from sitl.attitude import Vector
from sitl.autopilot.vehicle import START_US
from sitl.calibration import disturbance_scale
from sitl.campaign.onboard import Onboard
from sitl.flight import Flight
from sitl.scenario.script import Phase
from sitl.scenario.spec import Scenario
from sitl.wire.endpoint import COMPANION, GROUND, Endpoint


def fly(
    scenario: Scenario,
    design: DobDesign,
    seed: int = 1,
    delay: int = 1,
    scale: Vector | None = None,
    moments: str = "held",
) -> Flight:
    """Fly both windows; wall time is the vehicle's. The disturbance's size is found unless it is given."""
    if scale is None:
        scale = disturbance_scale(scenario, seed)
    flight = Flight(scenario, seed, scale, delay_samples=delay)
    endpoint, companion = Endpoint(flight, moments=moments), Companion(design)
    station = mav.MAVLink(None, 255, 190)
    asked = False
    while not flight.complete:
        endpoint.step()
        _exchange(endpoint, companion, (flight.vehicle.now_us - START_US) * 1e-6)
        while not endpoint.newest_answered:  # sample 0 repeats until they have met
            assert flight.vehicle.now_us == START_US
            endpoint.repeat()
            _exchange(endpoint, companion, 0.0)
        if flight.script.awaiting == "DOB_ENABLE=1" and not asked:
            asked = True
            write_on = mav.MAVLink_param_set_message(1, 191, b"DOB_ENABLE", 1.0, mav.MAV_PARAM_TYPE_REAL32)
            endpoint.receive(GROUND, write_on.pack(station))
            _exchange(endpoint, companion, (flight.vehicle.now_us - START_US) * 1e-6)
            assert not flight.script.awaiting
    return flight


def _exchange(endpoint: Endpoint, companion: Companion, now: float) -> None:
    endpoint.advance(now)
    endpoint.bytes_to_send(GROUND)
    for datagram in endpoint.bytes_to_send(COMPANION):
        companion.receive(datagram, now)
    companion.advance(now)
    for message in companion.bytes_to_send():
        endpoint.receive(COMPANION, message)


def fly_on_board(scenario: Scenario, design: DobDesign, scale: Vector) -> Flight:
    """The same flight without MAVLink, as campaigns fly it: the same to the last bit, in less than half the time
    (tests/sitl/campaign/test_wire.py)."""
    flight = Flight(scenario, 1, scale)
    onboard = Onboard(design, {}, flight, prompt=False)
    while not flight.complete:
        sample, _ = flight.step()
        onboard.sample(sample)
        if flight.script.phase is Phase.WAIT_OBSERVER:
            onboard.write("DOB_ENABLE", 1.0)
            flight.script.observer_reported(True)
    return flight
