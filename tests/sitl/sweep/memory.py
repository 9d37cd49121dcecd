"""Vehicle and sweep in lockstep in one process: the same bytes as over sockets."""

from dataclasses import replace

from sitl.flight import Flight
from sitl.scenario.spec import load
from sitl.sweep.client import SweepClient
from sitl.wire.endpoint import COMPANION, Endpoint


def vehicle(airframe: str = "linear", flexible: bool = False) -> Endpoint:
    """A vehicle that waits for commands, to hover at 5 m in still air."""
    scenario = replace(load("calm"), airframe=airframe, hover_altitude=5.0)
    flight = Flight(scenario, 1, await_arming=True, record=False)
    flight.vehicle.airframe.condition.flexible = flexible
    return Endpoint(flight)


def fly(client: SweepClient, endpoint: Endpoint, samples: int = 200_000) -> None:
    """Until the client is done; heartbeats by vehicle time."""
    for k in range(samples):
        endpoint.step()
        endpoint.advance(k * 0.004)
        while data := b"".join(endpoint.bytes_to_send(COMPANION)):
            client.receive(data)
            if answer := client.bytes_to_send():
                endpoint.receive(COMPANION, answer)
        if client.done:
            return
    raise AssertionError(client.phase)
