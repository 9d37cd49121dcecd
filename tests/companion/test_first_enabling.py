"""The first enabling in a flight goes in steps (docs/interfaces.md, First enabling)."""

import numpy as np
import pytest

from dob_companion.companion import Companion, CompanionConfig, parse_config
from dob_companion.errors import ConfigError
from dob_companion.supervisor import FirstEnabling, State
from tests.companion.aircraft import DT, Aircraft, small_design, texts


def on_board(shares=(0.3,), seconds=1.0, **parameters):
    config = CompanionConfig(first_enabling=FirstEnabling(shares, seconds), parameters=parameters)
    plane = Aircraft(Companion(small_design(), config), rates=(0.1, 0.1, 0.1))  # d_hat comes to 0.1
    plane.heartbeat()
    plane.pairs(600)
    return plane


def fades(plane, samples):
    """The fade of each answer, and the states."""
    plane.write("DOB_ENABLE", 1.0)
    found = []
    for _ in range(samples):
        (answer,) = plane.pair()
        found.append((-answer.x / 0.1, plane.companion.status().state))
    fade, states = np.array([f for f, _ in found]), [s for _, s in found]
    return fade, states


def first(states, state):
    return next((k for k, s in enumerate(states) if s is state), None)


def test_a_third_is_carried_for_a_second_before_the_rest_comes():
    fade, states = fades(on_board(), 600)
    begin, active = first(states, State.RAMP_IN), first(states, State.ACTIVE)
    at_share = np.flatnonzero(np.abs(fade - 0.3) < 1e-3)
    assert at_share.size * DT == pytest.approx(1.0, abs=2 * DT)
    assert (active - begin) * DT == pytest.approx(0.5 + 1.0, abs=5 * DT)
    assert {*states[begin:active]} == {State.RAMP_IN}
    assert np.diff(fade).max() <= DT / 0.5 + 1e-4
    assert fade[-1] == pytest.approx(1.0, abs=1e-3)


def test_as_many_shares_as_are_asked_for_each_for_its_time():
    fade, _ = fades(on_board((0.25, 0.5), 0.4), 600)
    for share in (0.25, 0.5):
        assert np.count_nonzero(np.abs(fade - share) < 1e-3) * DT == pytest.approx(0.4, abs=2 * DT)


def test_without_shares_it_fades_in_at_once():
    fade, states = fades(on_board(()), 300)
    begin, active = first(states, State.RAMP_IN), first(states, State.ACTIVE)
    assert (active - begin) * DT == pytest.approx(0.5, abs=3 * DT)
    moving = np.diff(fade)[begin : active - 1]
    assert moving == pytest.approx(DT / 0.5, abs=1e-3)


def test_a_second_enabling_in_the_same_flight_fades_in_at_once():
    plane = on_board()
    fades(plane, 600)
    plane.write("DOB_ENABLE", 0.0)
    plane.until(State.DISABLED)
    _, states = fades(plane, 300)
    assert (first(states, State.ACTIVE) - first(states, State.RAMP_IN)) * DT == pytest.approx(0.5, abs=3 * DT)


@pytest.mark.parametrize("ends", ["disarmed", "landed", "rebooted"])
def test_the_next_flight_begins_with_steps_again(ends):
    plane = on_board()
    fades(plane, 600)
    if ends == "disarmed":
        plane.armed = False
        plane.heartbeat()
        plane.pairs(300)
        plane.armed = True
        plane.heartbeat()
    elif ends == "landed":
        plane.flight = (1, 0)
        plane.pairs(300)
        plane.flight = (2, 0)
    else:
        plane.sample = 0
    fade, states = fades(plane, 1500)
    assert State.ACTIVE in states
    fresh = fade[first(states, State.RAMP_IN) if first(states, State.RAMP_IN) else 0 :]
    assert np.count_nonzero(np.abs(fresh - 0.3) < 1e-3) * DT == pytest.approx(1.0, abs=2 * DT)


def test_steps_that_are_broken_off_begin_anew():
    plane = on_board()
    fades(plane, 200)
    plane.write("DOB_ENABLE", 0.0)
    plane.until(State.DISABLED)
    fade, _ = fades(plane, 600)
    assert np.count_nonzero(np.abs(fade - 0.3) < 1e-3) * DT == pytest.approx(1.0, abs=2 * DT)


def test_the_configuration_says_how():
    config = parse_config("[first_enabling]\nshares = [0.1, 0.5]\nseconds = 2\n", "c.toml")
    assert config.first_enabling == FirstEnabling((0.1, 0.5), 2)
    assert parse_config("", "c.toml").first_enabling == FirstEnabling((0.3,), 1.0)
    assert parse_config("[first_enabling]\nshares = []\n", "c.toml").first_enabling.shares == ()


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("shares = 0.3", "first_enabling: shares: expected an array"),
        ("shares = [0.5, 0.2]", "first_enabling: shares: expected rising numbers between 0 and 1, got [0.5, 0.2]"),
        ("shares = [1.0]", "first_enabling: shares: expected rising numbers between 0 and 1"),
        ("shares = [true]", "first_enabling: shares: expected an array of finite numbers"),
        ("shares = [nan]", "first_enabling: shares: expected an array of finite numbers"),
        ("seconds = 0", "first_enabling: seconds: expected a number from 0.1 to 60, got 0"),
        ("second = 1", "first_enabling: unknown key 'second'"),
    ],
)
def test_what_is_no_plan_is_named(text, named):
    with pytest.raises(ConfigError) as problem:
        parse_config(f"[first_enabling]\n{text}\n", "c.toml")
    assert named in str(problem.value)


def test_trouble_in_the_first_step_ends_it_as_any_other():
    plane = on_board()
    fades(plane, 100)
    plane.thrust = 0.01
    plane.pairs(2)
    assert plane.companion.status().state is State.RAMP_OUT
    assert any("throttle" in text for text in texts(plane.said))
