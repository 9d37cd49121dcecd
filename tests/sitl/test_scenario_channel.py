"""The link's weather: what is lost, what is late, and that the same seed gives the same."""

from sitl.autopilot.vehicle import START_US
from sitl.channel import Channel, Quality
from sitl.constants import DT_US

VALUE = (0.1, 0.2, 0.3)


def stamps(count: int) -> list[int]:
    return [START_US + k * DT_US for k in range(count)]


def flown(channel: Channel, count: int = 400) -> list[tuple[int, int]]:
    """Answer every sample at once; (sample, sample in which its answer came through)."""
    came = []
    for k, stamp in enumerate(stamps(count)):
        channel.sample(stamp)
        channel.take(stamp, VALUE, stamp)
        came += [((s - START_US) // DT_US, k) for s, _ in channel.due(stamp)]
    return came


def test_a_clean_link_passes_every_answer_at_once():
    assert flown(Channel(1)) == [(k, k) for k in range(400)]


def test_a_longer_link_holds_every_answer_for_the_same_number_of_samples():
    assert flown(Channel(1, 3)) == [(k, k + 2) for k in range(398)]


def test_a_delay_step_adds_to_the_link_s_own_delay():
    channel = Channel(1, 2)
    channel.quality = Quality(delay_samples=4)
    assert flown(channel)[0] == (0, 5)


def test_jitter_is_spread_evenly_and_lets_answers_overtake():
    channel = Channel(1)
    channel.quality = Quality(jitter_samples=2)
    came = flown(channel, 3000)
    late = [now - k for k, now in came]
    assert {n: round(late.count(n) / len(late), 1) for n in (0, 1, 2)} == {0: 0.3, 1: 0.3, 2: 0.3}
    assert [k for k, _ in came] != sorted(k for k, _ in came)


def test_losses_come_in_the_share_asked_for():
    channel = Channel(1)
    channel.quality = Quality(pairs_lost=0.1, answers_lost=0.2)
    pairs = 0
    answers = 0
    for stamp in stamps(4000):
        channel.sample(stamp)
        pairs += channel.pair_lost
        answers += not channel.take(stamp, VALUE, stamp)
    assert abs(pairs / 4000 - 0.1) < 0.02
    assert abs(answers / 4000 - (1 - 0.9 * 0.8)) < 0.02


def test_the_same_seed_and_segment_lose_and_delay_the_same_answers():
    def one(seed: int, stream: int) -> list[tuple[int, int]]:
        channel = Channel(seed)
        channel.begin(stream)
        channel.quality = Quality(answers_lost=0.3, jitter_samples=3)
        return flown(channel)

    assert one(1, 1) == one(1, 1)
    assert one(1, 1) != one(2, 1)


def test_what_is_drawn_for_a_sample_does_not_depend_on_when_its_answer_arrives():
    channel = Channel(5)
    channel.quality = Quality(answers_lost=0.5)
    for stamp in stamps(100):
        channel.sample(stamp)
    late = [channel.take(stamp, VALUE, stamps(101)[-1]) for stamp in stamps(100)]
    prompt = Channel(5)
    prompt.quality = Quality(answers_lost=0.5)
    at_once = []
    for stamp in stamps(100):
        prompt.sample(stamp)
        at_once.append(prompt.take(stamp, VALUE, stamp))
    assert late == at_once
