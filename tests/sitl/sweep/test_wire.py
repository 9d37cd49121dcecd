"""The sweep through MAVLink: in memory, and as two processes with a socket between them."""

import tomllib

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from sitl.airframe.linear import PITCH, ROLL
from sitl.errors import FlightFailedError
from sitl.sweep.cli import main
from sitl.sweep.client import Phase, SweepClient
from sitl.sweep.identify import identify
from sitl.sweep.multisine import Plan, excitation
from sitl.wire.endpoint import COMPANION
from tests.pages import table
from tests.sitl.sweep.memory import fly, vehicle

SHORT = Plan(realizations=3, period=2500, lead=1500)


def test_the_linear_airframe_is_found_again_through_the_wire():
    client = SweepClient([(1, excitation(SHORT, 1))])
    fly(client, vehicle())
    fit = identify("pitch", SHORT, client.records[0]).fit
    assert fit.model.gain == pytest.approx(PITCH.gain, rel=0.01)
    assert fit.model.zero == pytest.approx(PITCH.zero, abs=0.03)
    assert fit.model.pole == pytest.approx(PITCH.pole, abs=3e-4)
    assert fit.chi2 < 2.0
    u_e, gyro, correction = client.records[0]
    np.testing.assert_allclose(correction, excitation(SHORT, 1), atol=1e-8)  # single precision on the wire
    assert np.abs(u_e).max() < 0.25
    assert np.abs(gyro).max() < 2.0


def test_a_sweep_of_one_axis_by_the_command_line_leaves_a_spec_and_a_figure(tmp_path, capsys, monkeypatch):
    """The vehicle is a process; the sweep is a short one."""
    monkeypatch.setattr("sitl.sweep.cli.Plan", lambda: SHORT)
    arguments = ("--airframe", "linear", "--axis", "roll", "--realizations", "2", "-o", str(tmp_path))
    assert main([*arguments]) == 0
    printed = capsys.readouterr().out
    (block,) = tomllib.loads((tmp_path / "plants.toml").read_text())["block"]
    assert block["axes"] == ["roll"]
    assert block["plant"]["gain"] == pytest.approx(ROLL.gain, rel=0.03)
    assert block["plant"]["zeros"] == [pytest.approx(ROLL.zero, abs=0.1)]
    assert block["plant"]["poles"] == [1.0, pytest.approx(ROLL.pole, abs=1e-3)]
    assert "roll" in printed
    assert (tmp_path / "roll.png").read_bytes().startswith(b"\x89PNG")
    saved = np.load(tmp_path / "roll.npz")
    assert saved["frequency"].shape == saved["response"].shape


@pytest.mark.proof
@pytest.mark.parametrize("options", [("--airframe", "linear"), (), ("--flexible",)], ids=" ".join)
def test_the_documented_tables_are_what_the_command_prints(options, tmp_path, capsys):
    assert main([*options, "-o", str(tmp_path)]) == 0
    command = " ".join(("python -m sitl.sweep", *options, "-o sweep"))
    assert capsys.readouterr().out.splitlines() == table("identification.md", command)


def test_a_refusal_ends_the_sweep_and_says_in_which_phase():
    client, endpoint = SweepClient([]), vehicle()
    pilot = mavlink.MAVLink(None, 255, 190)
    endpoint.step()
    client.receive(b"".join(endpoint.bytes_to_send(COMPANION)))
    client.bytes_to_send()
    refused = mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_RESULT_DENIED)
    with pytest.raises(FlightFailedError, match="arm: the vehicle answered MAV_RESULT_DENIED"):
        client.receive(refused.pack(mavlink.MAVLink(None, 1, 1)))
    client.receive(refused.pack(pilot))  # nobody else's refusal counts


@pytest.mark.parametrize(
    ("command", "result", "target"),
    [
        (mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_RESULT_DENIED, 191),
        (mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAV_RESULT_DENIED, 191),
        (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_RESULT_IN_PROGRESS, 191),
        (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_RESULT_DENIED, 190),
    ],
)
def test_only_the_answer_to_what_the_phase_asks_moves_the_sweep_or_ends_it(command, result, target):
    client, phase = SweepClient([]), SweepClient([]).phase
    ack = mavlink.MAVLink_command_ack_message(command, result, 0, 0, 1, target)
    client.receive(ack.pack(mavlink.MAVLink(None, 1, 1)))
    assert client.phase is phase


def test_a_missing_sample_spoils_a_sweep_and_a_repeat_does_not():
    client, endpoint = SweepClient([(0, excitation(SHORT, 1))]), vehicle()

    def heard() -> bytes:
        endpoint.step()
        return b"".join(endpoint.bytes_to_send(COMPANION))

    while client.phase is not Phase.EXCITE:
        client.receive(heard())
        endpoint.receive(COMPANION, client.bytes_to_send())
        client.receive(b"".join(endpoint.bytes_to_send(COMPANION)))
    pair = heard()
    for _ in range(3):
        client.receive(pair)
    answers = mavlink.MAVLink(None, 0, 0).parse_buffer(client.bytes_to_send())
    corrections = [(m.time_usec, m.x) for m in answers if m.get_type() == "DEBUG_VECT"]
    assert len(corrections) == 3
    assert len(set(corrections)) == 1
    heard()
    with pytest.raises(FlightFailedError, match="expected 4000 µs more"):
        client.receive(heard())


def test_what_cannot_begin_says_so_in_one_line(tmp_path, capsys):
    assert main(["--link", "udp:nowhere", "-o", str(tmp_path)]) == 2
    assert capsys.readouterr().err.startswith("sweep: link 'udp:nowhere': expected udpin")
