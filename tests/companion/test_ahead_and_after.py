"""What is worked out ahead of a sample, or put off until its answer has left, changes no answer."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from dob_companion.companion.dob import DobLoop
from dob_companion.companion.parameters import Parameters
from dob_companion.mavlink import AppliedMoment, GyroSample, ParamWrite, Sender
from dob_companion.observer import ObserverBank
from dob_companion.supervisor import State
from tests.companion.aircraft import small_design

three = st.tuples(*[st.floats(-1, 1, width=32)] * 3)


@given(st.lists(st.tuples(three, three, st.sampled_from(["nothing", "right", "wrong", "twice"]), three), max_size=30))
def test_an_observer_that_foresees_estimates_what_one_does_that_does_not(samples):
    plain, ahead = ObserverBank(small_design()), ObserverBank(small_design())
    for rates, moment, foreseen, other in samples:
        if foreseen in ("wrong", "twice"):
            ahead.foresee(rates, other)
        if foreseen in ("right", "twice"):
            ahead.foresee(rates, moment)
        plain.advance(rates, moment)
        ahead.advance(rates, moment)
        assert ahead.estimate(rates) == plain.estimate(rates)


def test_what_was_foreseen_is_forgotten_with_the_state():
    bank = ObserverBank(small_design())
    bank.advance((0.5, 0.0, 0.0), (0.0, 0.0, 0.0))
    bank.foresee((0.5, 0.0, 0.0), (0.0, 0.0, 0.0))
    bank.reset()
    bank.advance((0.5, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert bank.estimate((0.0, 0.0, 0.0)) == (0.25, 0.0, 0.0)


def flown(follow_up, steps):
    """Answers and state of a loop on stamps with the given steps, µs."""
    parameters = Parameters({"DOB_ENABLE": 0.0})
    loop, rng, stamp, answers = DobLoop(small_design(), parameters), np.random.default_rng(4), 0, []
    for k in range(1500):
        stamp += steps[k % len(steps)]
        if k % 250 == 0:
            loop.heartbeat(True, stamp * 1e-6)
        if k == 600:
            parameters.write(ParamWrite("DOB_ENABLE", 1.0, None, True, Sender(255, 190)))
        rates, moment = (tuple(rng.normal(0.0, 0.01, 3).tolist()) for _ in range(2))
        answers.append(loop.gyro(GyroSample(stamp, rates), stamp * 1e-6))
        if follow_up:
            loop.follow_up()
            loop.follow_up()
        loop.moment(AppliedMoment(stamp, moment, 0.5, (0.0, 0.0, 0.0), 1.0))
    return answers, loop.state, loop.figures()


@settings(max_examples=5, deadline=None)
@given(st.sampled_from([(4000,), (2500, 5000), (4016,), (3500, 4700)]))
def test_who_does_not_call_for_what_follows_an_answer_gets_the_same_answers(steps):
    assert flown(True, steps) == flown(False, steps)


def test_the_loop_of_these_tests_does_inject():
    answers, state, _ = flown(True, (4000,))
    assert state is State.ACTIVE
    assert answers[-1].correction != (0.0, 0.0, 0.0)
