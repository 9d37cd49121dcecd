"""A flight under every fault we know: nothing is ever computed from bad data, and it always comes back."""

import numpy as np
import pytest

from dob_companion.mavlink.codec import Codec
from dob_companion.observer import missing_samples
from tests.companion.aircraft import small_design
from tests.companion.takeup import TakeUp
from tests.endurance.campaign import KINDS, Campaign
from tests.endurance.oracle import LONGEST_MOMENT, LONGEST_RUN, Oracle
from tests.endurance.processes import full_disk, killed

SLOWEST_RECOVERY_S = 6.0
"""2 s to fill the window of the rate, 0.5 s good on end, 0.5 s fading in; twice the last two when loss interrupts."""


def judged(campaign):
    assert campaign.oracle.wrong == []
    assert campaign.takeup.wrong == []
    assert campaign.takeup.timeouts > 3
    assert campaign.unrecovered == []
    assert campaign.oracle.fresh > 0.3 * campaign.samples
    assert max(map(max, campaign.recoveries.values())) < SLOWEST_RECOVERY_S
    assert campaign.a_second_autopilot()


def test_forty_seconds_of_faults_make_no_correction_from_bad_data():
    judged(Campaign(2).fly(40.0))


def test_the_oracle_knows_the_bounds_of_its_design():
    assert missing_samples(small_design()) == (LONGEST_RUN, LONGEST_MOMENT)


@pytest.mark.proof
def test_an_hour_of_faults_makes_no_correction_from_bad_data():
    campaign = Campaign(3).fly(3600.0)
    judged(campaign)
    assert min(len(campaign.recoveries[kind]) for kind in KINDS) > 20


def test_the_oracle_finds_a_companion_that_listens_to_strangers(monkeypatch):
    ours = Codec._by_profile
    monkeypatch.setattr(Codec, "_by_profile", lambda self, _system, *frame: ours(self, self.system, *frame))
    assert Campaign(1).fly(10.0, ["hostile second system"]).oracle.wrong


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ((-0.1, 0.0, 0.0), (-0.10001, 0.0, 0.0)),
        ((-0.1, 0.0, 0.0), (0.1, 0.0, 0.0)),
        ((-0.1, 0.0, 0.0), (-0.1, 0.01, 0.0)),
        ((0.0, 0.0, 0.0), (-0.1, 0.0, 0.0)),
    ],
)
def test_the_oracle_finds_a_correction_that_is_off_or_steps(before, after):
    oracle = Oracle()
    stamp = 0
    for k in range(300):  # x goes to 0.1; f is driven from 0 to 1
        stamp = 4000 * k
        oracle.gyro(stamp, (0.1, 0.0, 0.0))
        x = oracle._x[0]
        f = min(1.0, max(0.0, 0.008 * (k - 50))) if before[0] else 0.0
        oracle.correction(stamp, (-f * x, 0.0, 0.0) if f else (0.0, 0.0, 0.0))
        oracle.moment(stamp, (0.0, 0.0, 0.0))
    assert oracle.wrong == []
    oracle.gyro(stamp + 4000, (0.1, 0.0, 0.0))
    oracle.correction(stamp + 4000, after)
    assert len(oracle.wrong) == 1


@pytest.mark.parametrize(
    ("silence_ms", "values", "wrong"),
    [
        (150, [-0.2], 1),  # held and fading, and back up
        (300, [-0.2], 1),  # from zero to full
        (300, [0.0, -0.2], 1),  # no ramp in between
        (300, [0.0, *np.linspace(0, -0.3, 126)], 0),
        (90, [-0.2], 0),  # no time-out: held throughout
    ],
)
def test_the_judge_of_what_acts_finds_a_correction_that_comes_back_without_a_ramp_in(silence_ms, values, wrong):
    vehicle, now = TakeUp(largest=0.3), 1_000_000
    vehicle.takes(now, (-0.2, 0.0, 0.0), now)
    now += 1000 * silence_ms
    for value in values:
        vehicle.takes(now, (float(value), 0.0, 0.0), now)
        now += 4000
    assert len(vehicle.wrong) == wrong


def test_killed_in_flight_it_answers_again_and_no_answer_is_missing_in_the_record():
    recoveries, missing = killed(1)
    assert len(recoveries) == 1
    assert missing == 0


def test_a_full_disk_costs_no_answer(tmp_path):
    replay, before, unanswered, troubles = full_disk(tmp_path)
    assert (unanswered, troubles, replay.difference) == (0, [], "")
    assert replay.corrections >= before
