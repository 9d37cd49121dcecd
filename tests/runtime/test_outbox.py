"""What waits for a line that takes less than it is given."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dob_companion.mavlink import is_correction
from dob_companion.mavlink.speaker import CORRECTION_MESSAGES, Speaker
from dob_companion.runtime.outbox import Outbox
from tests.runtime.messages import Ear, Talk

MUCH = 1 << 20


class Line:
    """Takes so many bytes at a time, and keeps what it has taken."""

    def __init__(self, takes=MUCH):
        self.takes = takes
        self.ear = Ear()

    def __call__(self, data):
        self.ear.hear(data[: self.takes])
        return min(self.takes, len(data))


@pytest.fixture
def talk():
    return Talk()


@pytest.mark.parametrize("carrier", CORRECTION_MESSAGES)
def test_a_correction_is_known_by_its_carrier(carrier, talk):
    assert is_correction(Speaker(carrier).correction(1, (0.0, 0.0, 0.0)))
    assert not is_correction(talk.text(1))


def test_of_waiting_corrections_only_the_newest_leaves_and_before_everything_else(talk):
    outbox, line = Outbox(MUCH), Line()
    for k in range(5):
        outbox.put(talk.text(k))
        outbox.put(talk.correction(k))
    outbox.flush(line, room=1)
    assert (line.ear.stamps, line.ear.texts) == ([4], [])
    assert outbox.overtaken == 4
    outbox.flush(line, MUCH)
    assert line.ear.texts == [0, 1, 2, 3, 4]
    assert outbox.dropped == 0


def test_on_a_line_that_takes_one_message_at_a_time_others_get_their_turn(talk):
    outbox, line = Outbox(MUCH), Line()
    for k in range(3):
        outbox.put(talk.text(k))
    for k in range(6):
        outbox.put(talk.correction(k))
        outbox.flush(line, room=1)
    assert line.ear.texts == [0, 1, 2]
    assert line.ear.stamps == [0, 2, 4]


def test_a_full_box_drops_the_oldest_of_the_others_whole_and_counts_them(talk):
    size = len(talk.text(0))
    outbox, line = Outbox(3 * size), Line()
    for k in range(8):
        outbox.put(talk.text(k))
    outbox.put(talk.correction(8))
    outbox.flush(line, MUCH)
    assert (line.ear.stamps, line.ear.texts) == ([8], [5, 6, 7])
    assert outbox.dropped == 5


def test_nothing_leaves_without_room(talk):
    outbox, line = Outbox(MUCH), Line()
    outbox.put(talk.correction(1))
    for room in (0, -5):
        outbox.flush(line, room)
    assert line.ear.stamps == []


def test_what_waited_for_a_line_that_is_gone_is_forgotten_with_the_part_that_had_begun(talk):
    outbox, line = Outbox(MUCH), Line(takes=5)
    outbox.put(talk.text(0))
    outbox.put(talk.text(1))
    outbox.flush(line, MUCH)
    outbox.clear()
    assert not outbox
    line = Line()
    outbox.put(talk.text(2))
    outbox.flush(line, MUCH)
    assert line.ear.texts == [2]


def test_messages_are_sealed_in_the_order_in_which_they_leave(talk):
    sealed = []
    outbox, line = Outbox(MUCH), Line()
    outbox.seal = lambda message: sealed.append(message) or message
    text, correction = talk.text(0), talk.correction(1)
    outbox.put(text)
    outbox.put(correction)
    outbox.flush(line, MUCH)
    assert sealed == [correction, text]


@given(steps=st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3), st.integers(0, 90)), max_size=40))
def test_whatever_the_line_takes_it_gets_whole_messages_in_order_and_the_newest_correction_last(steps):
    talk, outbox, line = Talk(), Outbox(200), Line()
    said = written = 0
    for corrections, texts, line.takes in steps:
        for _ in range(texts):
            outbox.put(talk.text(written))
            written += 1
        for _ in range(corrections):
            said += 1
            outbox.put(talk.correction(said))
        before = len(line.ear.stamps)
        outbox.flush(line, MUCH)
        new = line.ear.stamps[before:]
        assert len(new) <= 2, "besides one that had begun only the newest may leave"
    line.takes = MUCH
    outbox.flush(line, MUCH)
    for heard in (line.ear.stamps, line.ear.texts):
        assert heard == sorted(set(heard))
    assert line.ear.stamps[-1:] == ([said] if said else [])
    assert len(line.ear.stamps) + outbox.overtaken == said
    assert len(line.ear.texts) + outbox.dropped == written
