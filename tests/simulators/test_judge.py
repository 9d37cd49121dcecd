"""The judge of corrections finds what it is there for, and nothing in what is right."""

import numpy as np
import pytest

from tests.simulators.judge import compared
from tests.simulators.relay import corrupted, messages_in

LIMIT = 0.1


@pytest.fixture
def flight():
    """Ten seconds of corrections as complete data give them: stamps, corrections, the complete-data ones."""
    stamps = 1.0 + 0.004 * np.arange(2500)
    r = np.column_stack([0.08 * np.sin(3 * stamps), 0.06 * np.cos(2 * stamps), 0.09 * np.sin(stamps)])
    rng = np.random.default_rng(1)
    return stamps, r + 0.002 * rng.standard_normal(r.shape), r


def verdict(stamps, c, r, without=()):
    arrived = {round(1e6 * stamp) for stamp in stamps} - {round(1e6 * stamp) for stamp in without}
    return compared(stamps, c, r, arrived, LIMIT)


def test_corrections_near_those_of_complete_data_are_right(flight):
    found = verdict(*flight)
    assert found.wrong == 0
    assert found.rms == pytest.approx(0.02, rel=0.1)


def test_zeros_and_fades_are_right(flight):
    stamps, c, r = flight
    faded = c.copy()
    faded[500:625] = c[500] * np.linspace(1.0, 0.0, 125)[:, None]
    faded[625:900] = 0.0
    faded[900:1025] *= np.linspace(0.0, 1.0, 125)[:, None]
    assert verdict(stamps, faded, r).wrong == 0


@pytest.mark.parametrize(
    "spoil", [lambda c: -c, lambda c: c[:, [1, 0, 2]], lambda c: c + 0.08, lambda c: 0.0 * c + c[0]]
)
def test_a_second_of_other_corrections_shows_in_the_distance(flight, spoil):
    stamps, c, r = flight
    spoilt = c.copy()
    spoilt[1000:1250] = spoil(c[1000:1250])
    assert verdict(stamps, spoilt, r).rms > 3.0 * verdict(*flight).rms


def test_an_answer_to_a_sample_that_never_arrived_is_found(flight):
    assert verdict(*flight, without=flight[0][[7, 70]]).not_whole == 2


def test_a_sample_may_be_answered_twice_with_the_same_and_with_nothing_else(flight):
    stamps, c, r = flight
    twice = np.repeat(stamps, 2), np.repeat(c, 2, axis=0), np.repeat(r, 2, axis=0)
    assert verdict(*twice).wrong == 0
    twice[1][201] *= 0.5
    assert verdict(*twice).changed == 1


def test_more_than_the_limit_is_found(flight):
    stamps, c, r = flight
    c = c.copy()
    c[50, 1] = 0.101
    assert verdict(stamps, c, r).beyond_limit == 1


def test_the_relay_takes_a_datagram_apart_and_spoils_a_message_in_its_bytes():
    frames = [bytes([0xFD, size, 0, 0, *range(6)]) + bytes(size + 2) for size in (5, 20, 1)]
    assert list(messages_in(b"".join(frames))) == frames
    rng = np.random.default_rng(1)
    for frame in frames * 50:
        spoilt = corrupted(frame, rng)
        wrong = [8 * i + bit for i in range(len(frame)) for bit in range(8) if (frame[i] ^ spoilt[i]) >> bit & 1]
        assert wrong
        assert wrong[0] >= 16
