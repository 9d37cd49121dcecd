"""What the ground station of the flights makes of PX4's messages."""

import socket

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from tests.px4.simulator import Px4Ground, forget_the_dead


class Deaf(Px4Ground):
    """Without a link."""

    def __init__(self):
        self._boot_s, self.attitudes = 0.0, []


def test_the_socket_of_a_dead_simulator_is_removed_and_that_of_a_living_one_is_not(tmp_path):
    with socket.socket(socket.AF_UNIX) as living, socket.socket(socket.AF_UNIX) as dead:
        for each, name in ((living, "living"), (dead, "dead")):
            each.bind(str(tmp_path / name))
        living.listen()
        dead.close()
        for path in tmp_path.iterdir():
            forget_the_dead(path)
        assert [path.name for path in tmp_path.iterdir()] == ["living"]
    forget_the_dead(tmp_path / "none")


def truth(stamp_us):
    return mav.MAVLink_hil_state_quaternion_message(stamp_us, [1.0, 0.0, 0.0, 0.0], *[0] * 14)


def test_the_truth_bears_the_stamp_of_the_estimate_where_it_has_none():
    ground = Deaf()
    ground._take(mav.MAVLink_attitude_message(12_340, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0))
    ground._take(truth(0))
    ground._take(truth(99_000_000))
    assert [row[0] for row in ground.attitudes] == pytest.approx([12.34, 99.0])
    assert ground.attitudes[0][1:] == (0.0, 0.0, 0.0)
