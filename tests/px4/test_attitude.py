"""What a flight's attitudes are made of."""

import numpy as np
import pytest

from tests.px4.attitude import angles, parts


def quaternion(roll, pitch, yaw):
    """Of angles in deg, rotations about z, then y, then x."""

    def about(axis, deg):
        return np.array([np.cos(np.radians(deg) / 2), *(np.sin(np.radians(deg) / 2) * np.eye(3)[axis])])

    def times(a, b):
        return np.array([a[0] * b[0] - a[1:] @ b[1:], *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])

    return times(times(about(2, yaw), about(1, pitch)), about(0, roll))


def test_angles_are_those_of_the_rotation_and_do_not_jump_by_a_turn():
    wanted = np.array([[10.0, -20.0, 170.0], [-5.0, 7.0, 179.0], [0.0, 0.0, 185.0]])
    assert angles(np.array([quaternion(*row) for row in wanted])) == pytest.approx(wanted)


def test_what_is_asked_for_and_what_is_not_known_are_told_from_what_is_not_done():
    phase = np.linspace(0.0, 200.0 * np.pi, 20_000, endpoint=False)[:, None]
    asked, failed, unknown = (a * np.sin(k * phase) for a, k in ((3.0, 1), (0.5, 3), (2.0, 7)))
    found = parts(asked + failed, asked + failed + unknown, asked)
    rms = {"asked for": 3.0, "not known": 2.0, "truth": np.hypot(3.0, 0.5), "not done": np.hypot(0.5, 2.0)}
    for name, amplitude in rms.items():
        assert found[name] == pytest.approx(amplitude / np.sqrt(2.0), rel=1e-6)
