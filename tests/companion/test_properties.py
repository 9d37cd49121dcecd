"""Whatever comes in, what goes out keeps its promises."""

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common as mav

from dob_companion.supervisor import State
from tests.companion.aircraft import DT, Aircraft, Kept, aircraft, corrections
from tests.effort import examples

wild = st.one_of(
    st.floats(-3, 3, width=32), st.sampled_from([float("nan"), float("inf"), -float("inf"), 1e30, -1e30, 0.0])
)
three = st.tuples(wild, wild, wild)
actions = st.one_of(
    st.tuples(st.just("fly"), st.integers(1, 40), st.tuples(*[st.floats(-3, 3, width=32)] * 3)),
    st.tuples(st.just("fly"), st.integers(1, 40), three),
    st.tuples(st.just("skip"), st.integers(1, 30)),
    st.tuples(st.just("back"), st.integers(1, 600)),
    st.tuples(st.just("imu only"), three),
    st.tuples(st.just("moment only"), three, st.floats(width=32)),
    st.tuples(st.just("silence"), st.floats(0.0, 2.0)),
    st.tuples(
        st.just("write"),
        st.sampled_from(["DOB_ENABLE", "DOB_AXES", "DOB_GAIN", "DOB_LIMIT", "DOB_RAMP_S"]),
        st.one_of(st.sampled_from([0.0, 1.0, 2.0, 5.0, 7.0, 0.1]), wild),
    ),
    st.tuples(st.just("noise"), st.binary(min_size=1, max_size=60)),
)


def act(plane: Aircraft, action):
    match action:
        case "fly", count, rates:
            plane.rates = rates
            plane.pairs(count)
        case "skip", count:
            plane.sample += count
        case "back", count:
            plane.sample -= count
        case "imu only", rates:
            plane.deliver(plane.imu(rates=rates))
            plane.sample += 1
        case "moment only", moment, age:
            plane.deliver(plane.target(moment=moment, age=age))
        case "silence", seconds:
            until = plane.now + seconds
            while plane.now < until:
                plane.now = min(plane.companion.next_deadline(), until)
                plane.listen()
        case "write", name, value:
            plane.write(name, value)
        case "noise", data:
            plane.companion.receive(data, plane.now)


@cache
def active():
    return Kept(aircraft().active())


@settings(max_examples=examples(60), deadline=None)
@given(st.lists(actions, max_size=25))
def test_a_correction_is_finite_limited_slow_and_zero_unless_injecting(sequence):
    plane = active().again()
    sent = []
    spoken = len(plane.said)
    for action in [*sequence, ("write", "DOB_ENABLE", 0.0), ("fly", 1, (0.1, 0.1, 0.1))]:
        loop = plane.companion.loop
        step = (
            min(1.0, DT / plane.companion.parameters["DOB_RAMP_S"]) if plane.companion.parameters["DOB_RAMP_S"] else 1
        )
        f, a = loop.shaper.f, np.array(loop.shaper.a)
        answered = len(corrections(plane.said[spoken:]))
        act(plane, action)
        fresh = corrections(plane.said[spoken:])[answered:]
        moves = max(len(fresh), 1) + 1
        assert loop.shaper.f - f <= moves * step + 1e-9  # only a drop to zero may be quicker
        assert np.all(np.abs(loop.shaper.a - a) <= moves * step + 1e-9)
        if not loop.state.injecting:
            assert loop.shaper.f == 0.0
            assert not fresh or (fresh[-1].x, fresh[-1].y, fresh[-1].z) == (0.0, 0.0, 0.0)
        sent += fresh
    for message in sent:
        for value in (message.x, message.y, message.z):
            assert math.isfinite(value)
            assert abs(value) <= 1.0
    assert State(int(plane.companion.parameters["DOB_STATE"])) is plane.companion.status().state


@settings(max_examples=examples(200), deadline=None)
@given(st.binary(max_size=400))
def test_bytes_from_anywhere_never_raise(data):
    plane = aircraft()
    plane.heartbeat()
    plane.companion.receive(data, 0.0)
    plane.listen()


@pytest.fixture(scope="module")
def plane_in_flight():
    return aircraft().active()


@settings(max_examples=examples(100), deadline=None)
@given(st.integers(0, 400), st.integers(0, 255), st.floats(-1, 1, width=32))
def test_a_corrupted_message_is_dropped_whole(plane_in_flight, position, value, rate):
    plane = plane_in_flight
    good = bytes(plane.imu(rates=(rate, 0.0, 0.0)).pack(plane.out))
    bad = bytearray(good)
    bad[position % len(bad)] ^= value or 1
    stepped = plane.companion.status().stepped
    plane.companion.receive(bytes(bad), plane.now)
    assert plane.companion.status().stepped == stepped


def test_another_vehicles_parameter_traffic_is_left_alone():
    plane = aircraft()
    plane.heartbeat()
    heard = plane.deliver(mav.MAVLink_param_set_message(9, 191, b"DOB_ENABLE", 1.0, 9), by=plane.ground)
    assert [m for m in heard if m.get_type().startswith("PARAM")] == []
    assert plane.companion.parameters["DOB_ENABLE"] == 0.0
