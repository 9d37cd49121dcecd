"""The supervisor's table, quantified over every state and every combination of conditions."""

from itertools import product

import pytest

from dob_companion.supervisor import Conditions, State, Supervisor
from dob_companion.supervisor.table import TABLE

NAMES = ("wish", "fault", "data", "link", "flight", "model", "faded_in", "faded_out")
ALL = [
    Conditions(**dict(zip(NAMES, bits, strict=True)))
    for bits in product((False, True), repeat=len(NAMES))
    if not (bits[6] and bits[7])
]


def fitness(conditions):
    return conditions.link, conditions.flight, conditions.model


def after(state, conditions):
    supervisor = Supervisor()
    supervisor.state = state
    supervisor.judge(conditions)
    return supervisor.state


def test_every_state_has_a_row_and_the_numbers_are_those_of_the_wire():
    assert set(TABLE) == set(State)
    assert [state.name for state in State] == [
        "DISABLED", "WAITING", "TRACKING", "RAMP_IN", "ACTIVE", "RAMP_OUT", "FAULT",
    ]  # fmt: skip
    assert [int(state) for state in State] == list(range(7))


@pytest.mark.parametrize("state", [State.RAMP_IN, State.ACTIVE])
def test_whatever_speaks_against_injecting_leads_to_ramp_out_at_once(state):
    for conditions in ALL:
        if conditions.fault or not all((conditions.wish, conditions.data, *fitness(conditions))):
            assert after(state, conditions) is State.RAMP_OUT


def test_injecting_begins_only_from_tracking_and_only_when_everything_is_good():
    for state, conditions in product(State, ALL):
        if after(state, conditions) is State.RAMP_IN and state is not State.RAMP_IN:
            assert state is State.TRACKING
            assert conditions.wish
            assert conditions.data
            assert all(fitness(conditions))
            assert not conditions.fault


def test_a_state_that_injects_is_left_only_through_ramp_out():
    for state, conditions in product((State.RAMP_IN, State.ACTIVE), ALL):
        assert after(state, conditions).injecting


def test_ramp_out_ends_only_when_faded_out_and_never_turns_back():
    for conditions in ALL:
        end = after(State.RAMP_OUT, conditions)
        assert (end is State.RAMP_OUT) == (not conditions.faded_out)
        assert end not in (State.RAMP_IN, State.ACTIVE)


def test_a_fault_is_latched_until_the_operator_says_off():
    for conditions in ALL:
        assert after(State.FAULT, conditions) is (State.FAULT if conditions.wish else State.DISABLED)


def test_a_faded_out_fault_ends_in_fault_even_when_switched_off_meanwhile():
    for conditions in ALL:
        if conditions.fault and conditions.faded_out:
            assert after(State.RAMP_OUT, conditions) is State.FAULT


def test_disabled_moves_only_by_the_operators_wish():
    for conditions in ALL:
        assert after(State.DISABLED, conditions) is (State.WAITING if conditions.wish else State.DISABLED)


def test_off_is_reached_from_every_state_by_the_operator_alone():
    for start in State:
        supervisor = Supervisor()
        supervisor.state = start
        for _ in range(4):
            supervisor.judge(Conditions(**dict.fromkeys(NAMES, False) | {"faded_out": True}))
        assert supervisor.state is State.DISABLED


def test_every_transition_gives_a_reason():
    for state, conditions in product(State, ALL):
        supervisor = Supervisor()
        supervisor.state = state
        change = supervisor.judge(conditions)
        assert change is None or change.reason
