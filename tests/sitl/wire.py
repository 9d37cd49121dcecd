"""An endpoint in memory with parsers at both ends."""

from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from sitl.flight import Flight
from sitl.scenario.spec import load
from sitl.wire.endpoint import COMPANION, GROUND, Endpoint
from tests.sitl.bench import command, parser_of

OBSERVER, STATION = (1, 191), (255, 190)
ACCEPTED, REJECTED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_TEMPORARILY_REJECTED


class Wire:
    """A vehicle in still air on both of its links."""

    def __init__(self, await_arming: bool = True) -> None:
        self.flight = Flight(load("calm"), 1, await_arming=await_arming)
        self.endpoint = Endpoint(self.flight)
        self._parsers = {COMPANION: parser_of(), GROUND: parser_of()}
        self.step()

    def step(self) -> list:
        self.endpoint.step()
        return self.take(COMPANION)

    def take(self, link: str) -> list:
        data = b"".join(self.endpoint.bytes_to_send(link))
        return self._parsers[link].parse_buffer(data) or []

    def say(self, link: str, message: Any, source: tuple[int, int] | None = None) -> None:
        source = source or (OBSERVER if link == COMPANION else STATION)
        self.endpoint.receive(link, message.pack(mavlink.MAVLink(None, *source)))

    def meet(self) -> None:
        """Both sides make themselves known."""
        self.say(COMPANION, mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
        self.say(GROUND, mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        self.take(COMPANION)
        self.take(GROUND)

    def ask(self, message: Any) -> list:
        self.say(GROUND, message)
        return self.take(GROUND)

    def result(self, *arguments: float) -> int:
        acks = [m for m in self.ask(command(*arguments)) if m.get_type() == "COMMAND_ACK"]
        assert [(a.command, a.target_system, a.target_component) for a in acks] == [(arguments[0], *STATION)]
        return acks[0].result

    def correct(self, stamp: int, value: tuple[float, float, float], **how: Any) -> None:
        message = mavlink.MAVLink_debug_vect_message(how.get("name", b"DOB_CORR"), stamp, *value)
        self.say(how.get("link", COMPANION), message, how.get("source"))

    def take_off(self) -> None:
        assert self.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == ACCEPTED
        assert self.result(mavlink.MAV_CMD_NAV_TAKEOFF) == ACCEPTED
        for _ in range(400):
            self.step()


def kinds(messages: list) -> list[str]:
    return [m.get_type() for m in messages]
