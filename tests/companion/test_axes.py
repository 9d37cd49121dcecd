"""A vehicle that speaks in other axes than those of hover: turned where messages come in and go out, nowhere else."""

import itertools
import struct
from dataclasses import replace

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.companion import Companion, CompanionConfig, parse_config
from dob_companion.errors import ConfigError
from dob_companion.mavlink.axes import HOVER, ROTATIONS, AxisMap, VehicleAxes, axis_map
from tests.companion.aircraft import AT_ONCE, Aircraft, corrections, small_design, texts

FORWARD = axis_map(["yaw", "pitch", "-roll"])
"""Hover's axes of a tail-sitter's IMU: docs/interfaces.md, x = z_b, y = y_b, z = -x_b."""


def matrix(turn):
    return np.array([turn.inward(tuple(row)) for row in np.eye(3)]).T


def test_there_are_24_rotations_each_of_determinant_1_with_its_inverse_among_them():
    assert len(set(ROTATIONS)) == 24
    assert ROTATIONS[0] == HOVER
    for turn in ROTATIONS:
        assert round(np.linalg.det(matrix(turn))) == 1
        assert np.array_equal(matrix(turn.inverse), matrix(turn).T)
        assert axis_map(turn.words) == turn
    for first, then in itertools.product(ROTATIONS, repeat=2):
        assert np.array_equal(matrix(then.after(first)), matrix(then) @ matrix(first))


def test_the_imu_of_forward_flight_is_what_the_documentation_says():
    x_b, y_b, z_b = 1.0, 2.0, 3.0
    assert FORWARD.inward((x_b, y_b, z_b)) == (z_b, y_b, -x_b)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[axes]\ngyro = ["-roll", "pitch", "yaw"]', "axes: gyro: expected a rotation, of determinant +1; "),
        ('[axes]\nmoment = ["pitch", "roll", "yaw"]', 'axes: moment: expected a rotation, of determinant +1; ["pitch"'),
        ('[axes]\ngyro = ["roll", "roll", "yaw"]', "each of roll, pitch, yaw once"),
        ('[axes]\ngyro = ["roll", "pitch"]', "each of roll, pitch, yaw once"),
        ('[axes]\ngyro = ["--roll", "-pitch", "yaw"]', "each of roll, pitch, yaw once"),
        ("[axes]\ngyro = [1, 2, 3]", "axes: gyro: expected an array of strings"),
        ('[axes]\nimu = ["yaw", "pitch", "-roll"]', "imu"),
    ],
)
def test_what_is_no_rotation_is_refused_in_one_line_that_names_the_key(text, words):
    with pytest.raises(ConfigError, match=r"^c\.toml: ") as refused:
        parse_config(text, "c.toml")
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_the_configuration_names_hovers_axes_in_terms_of_the_vehicles():
    config = parse_config('[axes]\ngyro = ["yaw", "pitch", "-roll"]', "c.toml")
    assert config.axes == VehicleAxes(gyro=FORWARD, moment=HOVER)
    assert parse_config("", "c.toml").axes == VehicleAxes()


def answers(axes, enabled=True):
    """The vector that answers each sample of one flight of which a vehicle of these axes tells, as it takes it."""
    config = CompanionConfig(
        axes=axes, first_enabling=AT_ONCE.first_enabling, parameters={"DOB_ENABLE": float(enabled)}
    )
    plane = Aircraft(Companion(small_design(), config))
    rng, y = np.random.default_rng(3), np.zeros(3)
    for _ in range(1500):
        y = 0.8 * y + rng.normal(0.0, 0.01, 3)
        plane.rates = axes.gyro.outward(tuple(y.tolist()))
        plane.moment = axes.moment.outward(tuple((-0.1 * y).tolist()))
        plane.pair()
    return [(c.x, c.y, c.z) for c in corrections(plane.said)], plane


@pytest.mark.parametrize("axes", [VehicleAxes(FORWARD), VehicleAxes(FORWARD, axis_map(["-pitch", "-yaw", "roll"]))])
def test_a_flight_told_in_other_axes_is_answered_as_in_hovers_turned_to_the_vehicles(axes):
    told, plane = answers(axes)
    plain, _ = answers(VehicleAxes())
    assert any(any(answer) for answer in plain)
    assert [axes.moment.inward(answer) for answer in told] == plain
    assert plane.companion.status().state.name == "ACTIVE"


def test_off_is_a_zero_without_a_sign_in_any_axes():
    told, _ = answers(VehicleAxes(FORWARD, FORWARD), enabled=False)
    assert {struct.pack("<3d", *answer) for answer in told} == {bytes(24)}


def test_a_gyro_in_wrong_axes_is_not_injected_on_and_the_reason_names_two_axes():
    axes = VehicleAxes(FORWARD)
    plane = Aircraft(Companion(small_design(), CompanionConfig()))
    rng, y = np.random.default_rng(3), np.zeros(3)
    for k in range(2500):
        if k == 900:
            plane.write("DOB_ENABLE", 1.0)
        y = 0.8 * y + rng.normal(0.0, 0.01, 3)
        plane.rates, plane.moment = axes.gyro.outward(tuple(y.tolist())), tuple((-0.1 * y).tolist())
        plane.pair()
    assert {(c.x, c.y, c.z) for c in corrections(plane.said)} == {(0.0, 0.0, 0.0)}
    assert "roll is swapped with yaw" in plane.companion.status().why


def test_our_own_corrections_that_come_back_in_the_vehicles_axes_are_no_stranger():
    axes = VehicleAxes(FORWARD, FORWARD)
    config = replace(AT_ONCE, axes=axes, parameters={"DOB_ENABLE": 1.0})
    plane = Aircraft(Companion(small_design(), config))
    router = mav.MAVLink(None, srcSystem=1, srcComponent=191)
    rng, y = np.random.default_rng(3), np.zeros(3)
    injected = 0
    for _ in range(1500):
        y = 0.8 * y + rng.normal(0.0, 0.01, 3)
        plane.rates = axes.gyro.outward(tuple(y.tolist()))
        plane.moment = axes.moment.outward(tuple((-0.1 * y).tolist()))
        for answer in plane.pair():
            injected += any((answer.x, answer.y, answer.z))
            plane.deliver(answer, by=router)
    assert injected > 100
    assert not [text for text in texts(plane.said) if "another controller" in text]


def test_a_map_is_checked_however_it_is_made():
    with pytest.raises(ValueError, match="determinant"):
        AxisMap((1, 0, 2), (False, False, False))
