"""The mixer: within its limits for anything asked, exact where it can be, fair in what it gives up."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.airframe.mixer import PITCH, ROLL, YAW, Mixer

MIXER = Mixer(share=1.8, low=0.02, high=1.0)
torque = st.tuples(*[st.floats(-3.0, 3.0)] * 3)
thrust = st.floats(0.0, 1.0)
unhurried = settings(deadline=None)


@unhurried
@given(torque, thrust)
def test_no_rotor_is_asked_for_more_than_it_has(asked, lift):
    for command in MIXER.commands(*MIXER.allocate(asked, lift)):
        assert 0.02 - 1e-12 <= command <= 1.0 + 1e-12


@unhurried
@given(st.tuples(*[st.floats(-0.05, 0.05)] * 3), st.floats(0.3, 0.7))
def test_what_can_be_had_is_given_exactly(asked, lift):
    assert MIXER.allocate(asked, lift) == (asked, lift)


@unhurried
@given(torque, thrust)
def test_torque_never_grows_nor_turns_round(asked, lift):
    given_, _ = MIXER.allocate(asked, lift)
    for got, wanted in zip(given_, asked, strict=True):
        assert abs(got) <= abs(wanted) + 1e-12
        assert got * wanted >= 0.0


@unhurried
@given(torque, thrust)
def test_roll_and_pitch_keep_their_direction(asked, lift):
    (roll, pitch, _), _ = MIXER.allocate(asked, lift)
    assert roll * asked[1] == pytest.approx(pitch * asked[0], abs=1e-9)


@unhurried
@given(torque, thrust)
def test_yaw_gives_way_before_roll_and_pitch(asked, lift):
    alone, _ = MIXER.allocate((asked[0], asked[1], 0.0), lift)
    together, _ = MIXER.allocate(asked, lift)
    assert together[:2] == alone[:2]


@unhurried
@given(torque, thrust)
def test_allocating_again_changes_nothing(asked, lift):
    once = MIXER.allocate(asked, lift)
    (r, p, y), t = MIXER.allocate(*once)
    assert (r, p, y, t) == pytest.approx((*once[0], once[1]), abs=1e-12)


def test_thrust_makes_room_before_any_torque_is_cut():
    asked = (0.0, 0.2, 0.0)
    assert MIXER.allocate(asked, 0.1) == (asked, pytest.approx(0.02 + 0.36))
    assert MIXER.allocate(asked, 0.95) == (asked, pytest.approx(1.0 - 0.36))


@pytest.mark.parametrize(("axis", "signs"), [(0, ROLL), (1, PITCH), (2, YAW)])
def test_commands_follow_the_signs_of_each_axis(axis, signs):
    asked = tuple(0.1 if i == axis else 0.0 for i in range(3))
    assert MIXER.commands(asked, 0.5) == pytest.approx([0.5 + 0.18 * s for s in signs])
