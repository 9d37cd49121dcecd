"""A companion taken up in mid-flight from its snapshot goes on exactly as the one that it was taken from."""

import json

import numpy as np
import pytest

from dob_companion.companion import Companion
from dob_companion.flightlog.snapshot import SnapshotError, Snapshots, difference, restore
from dob_companion.supervisor import State
from tests.companion.aircraft import aircraft, small_design


class Noting:
    """A companion whose verbs are noted, so that they can be made again."""

    def __init__(self, companion):
        self.companion, self.verbs = companion, []

    def __getattr__(self, name):
        return getattr(self.companion, name)

    def receive(self, data, now):
        self.verbs.append(lambda c: c.receive(data, now))
        self.companion.receive(data, now)

    def advance(self, now):
        self.verbs.append(lambda c: c.advance(now))
        self.companion.advance(now)

    def close(self, now):
        self.verbs.append(lambda c: c.close(now))
        self.companion.close(now)


def newborn():
    return Companion(small_design())


def twin_of(companion, snapshots):
    """Another companion in the state of this one, by way of JSON text."""
    twin = newborn()
    restore(twin, json.loads(json.dumps(snapshots.take(companion))))
    return twin


def verbs_of_a_random_flight(seed):
    """Every way in which samples come and fail to come, after the correction has faded in and until it has left."""
    rng = np.random.default_rng(seed)
    plane = aircraft()
    plane.companion = Noting(plane.companion)
    plane.active()
    ready = len(plane.companion.verbs)
    for _ in range(60):
        plane.rates = tuple((0.02 * rng.normal(size=3)).tolist())
        plane.moment = tuple((0.02 * rng.normal(size=3)).tolist())
        plane.age = float(rng.integers(0, 3))
        _mishap(plane, int(rng.integers(0, 16)), rng)
        plane.pair()
    plane.deliver(plane.imu(rates=(float("nan"), 0.0, 0.0)))
    plane.pairs(2)
    plane.sample -= 400
    plane.pairs(2)
    plane.now += 0.6
    plane.listen()
    plane.write("DOB_ENABLE", 0.0)
    plane.companion.close(plane.now)
    plane.listen()
    return plane.companion.verbs, ready


def _mishap(plane, kind, rng):
    match kind:
        case 0:
            plane.sample += 1
        case 1:
            plane.deliver(plane.target(), plane.imu())
            plane.sample += 1
        case 2:
            plane.write("DOB_AXES", float(rng.integers(0, 8)))
        case 3:
            plane.write(str(rng.choice(["DOB_GAIN", "DOB_LIMIT", "DOB_RAMP_S"])), float(rng.random()))
        case 4:
            plane.companion.receive(rng.bytes(int(rng.integers(1, 80))), plane.now)
        case 5:
            plane.deliver(plane.imu(stamp=plane.stamp - 4000))
        case 6:
            plane.heartbeat()


@pytest.mark.parametrize("every", [5, pytest.param(1, marks=pytest.mark.proof)])
def test_restored_at_any_sample_of_a_random_flight_it_answers_identically(every):
    verbs, ready = verbs_of_a_random_flight(seed=1)
    snapshots, companion, seen = Snapshots(newborn()), newborn(), set()
    for number, verb in enumerate(verbs):
        if number % (100 if number < ready else every):
            verb(companion)
            companion.bytes_to_send()
            continue
        twin = twin_of(companion, snapshots)
        for each in (companion, twin):
            verb(each)
        assert twin.bytes_to_send() == companion.bytes_to_send()
        assert twin.next_deadline() == companion.next_deadline()
        assert twin.closed == companion.closed
        if number % 3 == 0:
            assert difference(snapshots.take(companion), snapshots.take(twin)) == ""
        seen.add(companion.status().state)
    assert {State.ACTIVE, State.RAMP_OUT, State.DISABLED} <= seen


def test_a_torn_message_on_a_byte_stream_is_part_of_the_state():
    companion = Companion(small_design(), datagrams=False)
    plane = aircraft()
    beat = bytes(plane.imu().pack(plane.out))
    companion.receive(beat[:20], 0.0)
    other = Companion(small_design(), datagrams=False)
    restore(other, Snapshots(Companion(small_design(), datagrams=False)).take(companion))
    for each in (companion, other):
        each.receive(beat[20:], 0.0)
        assert each.status().foreign == 1


def test_a_companion_just_built_has_no_state_and_matrices_never_are():
    snapshots = Snapshots(newborn())
    assert snapshots.take(newborn()) == {}
    flying = aircraft().active().companion
    assert not [path for path in snapshots.take(flying) if path.endswith(("._A", "._B", "._C", "._D", "._D_y"))]


def test_numbers_keep_every_bit():
    companion = newborn()
    companion.loop.d_hat = np.array([-0.0, np.nan, 5e-324])
    companion.loop.shaper.f = -0.0
    twin = twin_of(companion, Snapshots(newborn()))
    assert twin.loop.d_hat.tobytes() == companion.loop.d_hat.tobytes()
    assert str(twin.loop.shaper.f) == "-0.0"


def test_what_a_snapshot_cannot_hold_is_named():
    companion = newborn()
    companion.loop.answer = memoryview(b"")
    with pytest.raises(SnapshotError, match=r"loop\.answer"):
        Snapshots(newborn()).take(companion)


@pytest.mark.parametrize(
    "state",
    [
        {"loop.gone": 1},
        {"loop.d_hat": {"ndarray": ["<f8", [4], ""]}},
        {"loop.d_hat": {"pickle": "x"}},
        {"loop.supervisor.state": {"enum": ["dob_companion.supervisor.table", "State", "ASLEEP"]}},
        {"loop.answer": {"dataclass": ["subprocess", "Popen", []]}},
        {"loop.answer": {"dataclass": ["dob_companion.companion.core", "Companion", []]}},
        {"loop.answer": {"enum": ["os", "system", "true"]}},
    ],
)
def test_a_snapshot_that_does_not_fit_is_refused_and_builds_nothing(state):
    with pytest.raises(SnapshotError, match="state 'loop"):
        restore(newborn(), state)
