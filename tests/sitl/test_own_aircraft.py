"""Somebody's own aircraft: the plant and controllers of a design.json, flown as they stand there."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import cont2discrete

from dob_companion.lti.loop import weighted_loop
from dob_companion.lti.statespace import StateSpaceData, static
from dob_companion.synthesis import parse_spec
from dob_companion.synthesis.plant.models import to_state_space
from sitl.airframe.surroundings import Surroundings
from sitl.autopilot.controller import MatrixLaw
from sitl.autopilot.correction import CorrectionInput
from sitl.autopilot.vehicle import Vehicle
from sitl.calibration import disturbance_scale, peaks_off
from sitl.cli import main
from sitl.constants import AXES, DT
from sitl.errors import FlightFailedError, ScenarioError
from sitl.flight import Flight
from sitl.scenario.own_aircraft import load_aircraft
from sitl.scenario.script import Phase
from sitl.scenario.spec import load
from tests.sitl.bench import SHORT

PAPER = Path(__file__).parents[2] / "examples" / "tailsitter_paper.toml"
LOOSE, CALM = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)


def system(A, B, C, D):
    return {name: np.asarray(M, float).tolist() for name, M in zip("ABCD", (A, B, C, D), strict=True)}


def written(path, blocks, **more):
    """An aircraft file; `blocks` are (axes, plant, controller)."""
    content = {"schema": "dob-companion/aircraft/1", "dt": DT, "delay_samples": 1, **more}
    content["blocks"] = [{"axes": a, "problem": {"plant": p, "controller": c}} for a, p, c in blocks]
    path.write_text(json.dumps(content))
    return path


def paper_blocks():
    spec = parse_spec(PAPER.read_text(), str(PAPER))
    for block in spec.blocks:
        pair = [to_state_space(model, DT, (1, 1)) for model in (block.plant, block.controller)]
        yield [*block.axes], *(system(s.A, s.B, s.C, s.D) for s in pair)


def lagged(gain, tau, delay, share=0.3):
    """gain / (s (tau s + 1)) with `delay` samples at its input, and a PI that crosses over well below its lag."""
    A, B, C = np.array([[0.0, 1.0], [0.0, -1.0 / tau]]), np.array([[0.0], [gain / tau]]), np.array([[1.0, 0.0]])
    A, B, C, D, _ = cont2discrete((A, B, C, np.zeros((1, 1))), DT)
    for _ in range(delay):
        A, B = np.block([[A, B], [np.zeros((1, len(A) + 1))]]), np.vstack([np.zeros((len(A), 1)), [[1.0]]])
        C = np.hstack([C, [[0.0]]])
    crossover = share / (tau + (delay + 1) * DT)
    p, i = crossover / gain, 0.1 * crossover**2 / gain * DT
    return system(A, B, C, D), system([[1.0]], [[1.0]], [[i]], [[p]])


def hovering(own):
    vehicle = Vehicle(own.build())
    vehicle.arm()
    vehicle.take_off(2.0)
    while vehicle.airframe.altitude < 1.9:
        vehicle.step(Surroundings(), CALM, CorrectionInput())
    return vehicle


def test_the_papers_design_as_an_aircraft_flies_as_the_built_in_vehicle_does(tmp_path):
    own, _ = load_aircraft(written(tmp_path / "paper.json", paper_blocks()))
    scenario, scale = load("paper"), (0.05, 0.1, 0.05)
    built_in, matrices = Flight(scenario, 1, scale), Flight(scenario, 1, scale, aircraft=own.build())
    for flight in (built_in, matrices):
        while flight.script.phase is not Phase.OFF or flight.vehicle.now_us < 22_000_000:
            flight.step()
    a, b = built_in.log.arrays(), matrices.log.arrays()
    for name in ("rate", "u_e", "attitude_error"):
        size = np.max(np.abs(a[name]), axis=0)
        assert np.all(size > 1e-3)
        assert np.all(np.max(np.abs(a[name] - b[name]), axis=0) < 1e-5 * size), name


def test_coupled_axes_answer_an_impulse_as_the_loop_of_their_matrices(tmp_path):
    """The oracle wires the same matrices with the design side's own loop; the attitude loop is let go."""
    plant = StateSpaceData(
        [[0.9, 0.05, 0.0], [0.0, 0.95, 0.1], [0.0, 0.0, 0.99]],
        [[0.2, 0.0], [0.05, 0.1], [0.02, 0.3]],
        [[1.0, 0.0, 0.2], [0.1, 0.5, 0.6]],
        np.zeros((2, 2)),
    )
    controller = StateSpaceData(np.diag([1.0, 1.0]), 0.02 * np.eye(2), 0.1 * np.eye(2), [[0.3, 0.05], [-0.02, 0.4]])
    pair = [system(s.A, s.B, s.C, s.D) for s in (plant, controller)]
    own, _ = load_aircraft(written(tmp_path / "own.json", [(["roll", "pitch"], *pair)]))
    vehicle = hovering(own)
    vehicle.attitude_gain = LOOSE
    loop = weighted_loop(plant, controller, static(np.zeros((2, 4))), static(np.eye(2)), static(np.zeros((2, 2))), 1)
    x, kicks = np.zeros(len(loop.A)), [(0.3, -0.1)] + [(0.0, 0.0)] * 200
    for kick in kicks:
        sample = vehicle.step(Surroundings(torque=(*kick, 0.0)), CALM, CorrectionInput())
        w = np.array([*kick, 0.0, 0.0])
        for ours, (C, D) in ((sample.rate, loop.y_n), (sample.u_e, loop.u_e)):
            assert ours[:2] == pytest.approx(C @ x + D @ w, abs=3e-7)  # gyro and moment are single precision
        assert sample.rate[2] == 0.0
        x = loop.A @ x + loop.B @ w


@settings(max_examples=8, deadline=None)
@given(st.lists(st.tuples(st.floats(3.0, 600.0), st.floats(0.005, 0.08), st.integers(0, 6)), min_size=3, max_size=3))
def test_any_aircraft_whose_rate_loop_is_sound_hovers_and_comes_back_from_a_kick(tmp_path_factory, axes):
    blocks = [([name], *lagged(*numbers)) for name, numbers in zip(AXES, axes, strict=True)]
    own, _ = load_aircraft(written(tmp_path_factory.mktemp("own") / "own.json", blocks))
    vehicle = hovering(own)
    errors = []
    for k in range(3000):
        kick = 0.02 if k < 10 else 0.0
        sample = vehicle.step(Surroundings(torque=(kick, kick, kick)), CALM, CorrectionInput())
        errors.append(np.max(np.abs(sample.attitude_error)))
    assert max(errors) < 0.5
    assert errors[-1] < 0.1 * max(errors)
    assert abs(vehicle.airframe.altitude - 2.0) < 0.1


def test_a_scenarios_disturbance_is_found_for_an_own_aircraft_too(tmp_path):
    blocks = [([name], *lagged(300.0, 0.02, 1)) for name in AXES]
    own, _ = load_aircraft(written(tmp_path / "own.json", blocks))
    (tmp_path / "short.toml").write_text(SHORT)
    own, scenario = own.settled(), load(str(tmp_path / "short.toml"))
    scale = disturbance_scale(scenario, 1, own.build)
    assert peaks_off(scenario, 1, scale, own.build) == pytest.approx(scenario.disturbance.peak_attitude_error, rel=1e-5)


def test_a_controller_that_was_held_at_its_limit_leaves_it_as_soon_as_the_error_turns():
    c = lagged(300.0, 0.02, 1)[1]
    law = MatrixLaw([((1,), StateSpaceData(**c))])
    for _ in range(5000):
        assert abs(law.step((0.0, 20.0, 0.0))[1]) <= 1.0
    assert law.step((0.0, -1.0, 0.0))[1] < 1.0
    assert [law.step((0.0, -1.0, 0.0))[1] for _ in range(50)][-1] < 0.5


def test_what_the_file_leaves_out_is_said(tmp_path, capsys):
    path = written(tmp_path / "own.json", [(["pitch"], *lagged(300.0, 0.02, 1))], delay_samples=3)
    assert main(["paper", "--aircraft", str(path), "--about"]) == 0
    about = json.loads(capsys.readouterr().out)
    assert about["aircraft"]["axes"] == ["pitch"]
    assert about["aircraft"]["delay_samples"] == 3
    assert about["checks"] == 0  # the packaged ones are about the vehicles that come with it


def test_a_stated_attitude_gain_and_clock_are_flown(tmp_path):
    gain = {"roll": 2.0, "pitch": 3.0, "yaw": 1.0}
    path = written(tmp_path / "own.json", paper_blocks(), attitude_gain=gain, clock={"grid_us": 2500})
    own, clock = load_aircraft(path)
    assert own.settled().build().attitude_gain == (2.0, 3.0, 1.0)
    assert clock.grid_us == 2500


def test_a_plant_that_its_own_controller_does_not_hold_is_not_flown(tmp_path):
    plant, controller = lagged(300.0, 0.02, 1)
    controller["D"][0][0] *= 20.0
    own, _ = load_aircraft(written(tmp_path / "own.json", [(["yaw"], plant, controller)]))
    with pytest.raises(FlightFailedError, match=r"own\.json: yaw: the rate loop without an observer is unstable"):
        own.settled()


WRONG = [
    (lambda d: d.pop("dt"), "dt: expected a number"),
    (lambda d: d.update(dt=0.0025), "dt: 0.0025 s is 400 Hz; the simulated vehicle flies 250 Hz"),
    (lambda d: d.update(schema="nonsense"), "schema: 'nonsense' is unknown"),
    (lambda d: d.update(delay_samples=1.5), "delay_samples: expected a whole number"),
    (lambda d: d.update(delay_samples=10**400), "delay_samples: expected a number"),
    (lambda d: d.update(blocks=[]), "blocks: expected a list of objects"),
    (lambda d: d.update(blocks=d["blocks"] * 2), r"blocks\[1\].axes: expected different ones of roll, pitch, yaw"),
    (lambda d: d["blocks"][0].pop("problem"), r"blocks\[0\].problem: expected a table"),
    (lambda d: d["blocks"][0]["problem"]["plant"].pop("A"), r"blocks\[0\].problem.plant.A: expected a matrix"),
    (lambda d: d["blocks"][0]["problem"]["plant"]["A"].pop(), r"problem.plant.A: expected a matrix"),
    (lambda d: d["blocks"][0]["problem"]["plant"].update(B=[[1.0], ["x"], [0.0]]), r"plant.B: expected a number"),
    (lambda d: d["blocks"][0]["problem"]["plant"].update(D=[[1.0]]), r"plant.D: expected zeros"),
    (lambda d: d["blocks"][0]["problem"]["controller"].update(C=[[float("nan")]]), r"controller.C: expected a number"),
    (lambda d: d.update(attitude_gain={"roll": 1.0}), r"attitude_gain.pitch: expected a number"),
]


@pytest.mark.parametrize(("wrong", "words"), WRONG)
def test_a_malformed_file_gets_one_line_that_names_the_key(tmp_path, wrong, words, capsys):
    path = written(tmp_path / "own.json", [(["roll"], *lagged(300.0, 0.02, 1))])
    content = json.loads(path.read_text())
    wrong(content)
    path.write_text(json.dumps(content))
    with pytest.raises(ScenarioError, match=rf"own\.json: .*{words}"):
        load_aircraft(path)
    assert main(["calm", "--aircraft", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("text", ["", "[1, 2]", "{", "[" * 100_000, '{"dt": 1'])
def test_what_is_no_json_object_gets_one_line(tmp_path, text):
    path = tmp_path / "own.json"
    path.write_text(text)
    with pytest.raises(ScenarioError, match=r"own\.json: (not JSON|expected a JSON object)"):
        load_aircraft(path)
