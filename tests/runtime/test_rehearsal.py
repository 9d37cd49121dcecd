"""The twin answers what the companion has answered, and the companion does not notice (runtime/rehearsal.py)."""

import pytest

from dob_companion.runtime.rehearsal import LEAD_S, MOST_PIECES, Rehearsal
from dob_companion.supervisor import State
from tests.companion.aircraft import DT, Aircraft, aircraft


class Rehearsed:
    """A companion whose every piece is rehearsed, as `runtime.daemon` does it."""

    def __init__(self, companion):
        self.companion = companion
        self.rehearsal = Rehearsal(companion)
        self.said = []

    def __getattr__(self, name):
        return getattr(self.companion, name)

    def receive(self, data, now):
        self.companion.receive(data, now)
        self.rehearsal.heard(data, now)

    def bytes_to_send(self):
        messages = self.companion.bytes_to_send()
        self.said += messages
        self.rehearsal.run()
        return messages

    @property
    def twin(self):
        return self.rehearsal._twin


def flown(plane):
    plane.active()
    for k in range(100):
        plane.rates = (0.1, -0.05 + 0.001 * k, 0.0)
        plane.pair()
    return plane.companion


def test_a_rehearsed_companion_says_what_it_says_unrehearsed():
    alone = aircraft()
    alone.companion.said = []
    take = alone.companion.bytes_to_send

    def noted():
        messages = take()
        alone.companion.said += messages
        return messages

    alone.companion.bytes_to_send = noted
    rehearsed = Aircraft(Rehearsed(aircraft().companion))
    assert flown(rehearsed).said == flown(alone).said


def test_the_twin_goes_the_companions_way():
    companion = flown(Aircraft(Rehearsed(aircraft().companion)))
    assert companion.twin.loop.state is State.ACTIVE
    assert companion.twin.loop.answer == companion.loop.answer
    assert companion.twin.loop.answer.correction != (0.0, 0.0, 0.0)


def test_the_twin_knows_of_a_write_and_keeps_it_to_itself():
    plane = Aircraft(Rehearsed(aircraft().companion))
    plane.active()
    plane.write("DOB_GAIN", 0.25)
    plane.pairs(2)
    assert plane.companion.twin.parameters["DOB_GAIN"] == 0.25
    plane.companion.twin.parameters.settings = None
    assert plane.companion.parameters.settings.gain == 0.25


def test_a_rehearsal_is_due_shortly_before_the_next_sample():
    plane = Aircraft(Rehearsed(aircraft().companion))
    plane.heartbeat()
    plane.pairs(3)
    assert plane.companion.rehearsal.due == pytest.approx(plane.now - DT + DT - LEAD_S)


def test_a_flood_is_not_rehearsed():
    companion = Rehearsed(aircraft().companion)
    plane = Aircraft(companion)
    plane.heartbeat()
    for _ in range(1000):
        companion.receive(b"\xff" * 20, plane.now)
    companion.receive(bytes(plane.imu().pack(plane.out)), plane.now + DT)
    companion.rehearsal.run()
    assert companion.status().bad == 1000
    assert companion.twin.status().bad == MOST_PIECES - 1
