"""The demo from end to end: real processes, real sockets, a real ground station."""

import json
import signal
import statistics
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dob_companion.cli.demo import PAPER, TUNED, packaged
from dob_companion.cli.main import main
from dob_companion.demo.table import result_table
from dob_companion.demo.vehicle import is_tailsitter
from dob_companion.synthesis import parse_spec
from dob_companion.synthesis.spec.parse import Entries, Model
from tests.cli.processes import one_line, run_cli
from tests.recorder.flights import wait_until
from tests.sitl.bench import SHORT as SCENARIO

EXAMPLES = Path(__file__).parents[2] / "examples"


def fly(out, *more):
    finished = run_cli("demo", "-o", out, *more, timeout=None)  # its own patience has an end
    assert finished.returncode == 0, finished.stderr
    return json.loads((out / "result.json").read_text()), finished


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    out = tmp_path_factory.mktemp("demo")
    result, finished = fly(out, "--fast", "--seed", "1")
    return out, result, finished


def test_the_demo_writes_its_results_and_prints_the_same_numbers(flown):
    out, result, finished = flown
    tables = finished.stdout.partition("\n  /")[0].splitlines()
    tables += [line for line in finished.stderr.splitlines() if line.startswith(("block", "pitch", "roll", "yaw"))]
    assert len(tables) == 7 + 4
    assert max(map(len, tables)) <= 80
    assert {"design.json", "result.json", "report.html", "flight.png", "flight.npz"} <= {p.name for p in out.iterdir()}
    for axis in ("roll", "pitch", "yaw"):
        (row,) = [line for line in finished.stdout.splitlines() if line.startswith(axis)]
        assert f"{result['axes'][axis]['rms_on']:.5f}" in row
        assert f"{result['axes'][axis]['rms_ratio']:.1f}" in row


def test_the_readme_shows_the_table_that_the_command_prints(flown):
    _, _, finished = flown
    readme = (EXAMPLES.parent / "README.md").read_text(encoding="utf-8")
    shown = readme.partition("<!-- table: make demo DEMO_ARGS=--fast -->")[2].partition("<!-- end of table -->")[0]
    printed = finished.stdout.partition("\n  /")[0]
    assert shown.strip().removeprefix("```").removesuffix("```").strip() == printed.strip()


def test_the_flight_is_the_papers_and_nothing_is_lost(flown):
    _, result, _ = flown
    assert result["schema"] == "dob-companion/flight-result/1"
    assert result["delay_samples"] == 1
    assert result["rate_hz"] == pytest.approx(250.0)
    assert result["samples"] == 2 * 30 * 250
    assert result["samples_lost"] == 0
    for axis, peak in (("roll", 0.15), ("pitch", 0.12), ("yaw", 0.12)):
        assert result["axes"][axis]["peak_off"] == pytest.approx(peak, rel=2e-3)


def test_pitch_gains_what_an_independent_simulation_expects(flown):
    """RMS off/on 8.3–9.9 over 40 seeds for the τ = 1 design flown at τ = 1, pitch axis alone."""
    _, result, _ = flown
    assert 8.0 <= result["axes"]["pitch"]["rms_ratio"] <= 10.2
    assert all(numbers["rms_ratio"] > 3 for numbers in result["axes"].values())


@pytest.mark.proof  # a second demo; tests/sitl holds shorter flights to the byte
def test_the_same_seed_gives_the_same_flight_to_the_byte(flown, tmp_path):
    out, _, _ = flown
    fly(tmp_path, "--fast", "--seed", "1")
    assert (tmp_path / "result.json").read_bytes() == (out / "result.json").read_bytes()
    with np.load(out / "flight.npz") as first, np.load(tmp_path / "flight.npz") as second:
        for name in ("stamp_us", "gyro", "u_e", "correction", "age"):
            assert first[name].tobytes() == second[name].tobytes(), name


def test_the_correction_in_flight_is_the_observers_own_answer(flown):
    """An independent simulation of design.json over the recorded gyro and moment gives the recorded corrections."""
    out, _, _ = flown
    blocks = json.loads((out / "design.json").read_text())["blocks"]
    order = ("roll", "pitch", "yaw")
    with np.load(out / "flight.npz") as flight:
        gyro, u_e, correction, window = (flight[name] for name in ("gyro", "u_e", "correction", "window"))
    on = np.flatnonzero(window == 2)
    for block in blocks:
        A, B, C, D = (np.array(block[name]) for name in "ABCD")
        i = order.index(block["axes"][0])
        x, d_hat = np.zeros(len(A)), np.zeros(len(gyro))
        for k in range(len(gyro)):
            inputs = np.array([gyro[k, i], u_e[k, i]], dtype=np.float32).astype(float)
            d_hat[k] = (C @ x + D @ inputs)[0]
            x = A @ x + B @ inputs
        expected = -np.clip(d_hat[on - 1], -0.3, 0.3)
        assert np.max(np.abs(correction[on, i] - expected)) < 1e-6


@pytest.mark.parametrize("after_s", [0.5, 4.0])
def test_ctrl_c_at_any_moment_leaves_no_process_and_only_whole_files(tmp_path, after_s):
    process = subprocess.Popen(
        [sys.executable, "-m", "dob_companion", "demo", "-o", tmp_path], stderr=subprocess.PIPE, text=True
    )
    family = set()
    wait_until(lambda: catches(process.pid, signal.SIGINT))
    deadline = time.monotonic() + after_s
    while time.monotonic() < deadline and process.poll() is None:
        family |= children(process.pid)
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate()
    # Python itself ends by the signal, which a shell shows as 130 too, where it came within an exec() of the imports
    assert process.returncode in (130, -signal.SIGINT), errors
    assert "Traceback" not in errors
    wait_until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in family))
    for path in tmp_path.glob("*.json"):
        json.loads(path.read_text())
    assert not list(tmp_path.glob(".*"))


def catches(pid, number):
    """Whether a process has a handler for a signal: a Python that has only begun has none."""
    status = dict(line.split(":\t") for line in Path(f"/proc/{pid}/status").read_text().splitlines())
    return int(status["SigCgt"], 16) >> number - 1 & 1


def children(pid):
    try:
        return {int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()}
    except OSError:
        return set()


def demo_here(capsys, *arguments):
    """The command in this process, for what ends before it starts another."""
    code = main(["demo", *map(str, arguments)])
    return SimpleNamespace(returncode=code, stderr=capsys.readouterr().err)


def test_a_demo_that_cannot_write_says_so_in_one_line(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    finished = demo_here(capsys, "-o", tmp_path / "file" / "dir")
    assert finished.returncode == 2
    assert "file/dir" in finished.stderr.strip().splitlines()[-1]


SHORT = (
    # Time for the steps of a first enabling, and for a stall before it.
    SCENARIO.partition("[paper_ratio]")[0].replace("settle_s = 0.2", "settle_s = 8.0")
    + """
[[check]]
measure = "rms_ratio"
axis = "pitch"
at_least = 1.5
[[check]]
measure = "rms_ratio"
axis = "roll"
at_least = 1.5
"""
)


@pytest.fixture(scope="module")
def agile(tmp_path_factory):
    """Pitch three times as agile under a third of the gain, in a scenario of its own with checks."""
    directory = tmp_path_factory.mktemp("agile")
    (directory / "short.toml").write_text(SHORT)
    head, pitch, *_ = (EXAMPLES / "tailsitter_paper.toml").read_text(encoding="utf-8").split("[[block]]")
    pitch = pitch.replace("0.14131", "0.42393").replace("0.9002", "0.30007")
    (directory / "agile.toml").write_text(f"{head}[[block]]{pitch}")
    (directory / "out").mkdir()
    (directory / "out" / "result.json").write_text("of an earlier flight")
    finished = run_cli(
        "demo", "--fast", "-o", "out", "--scenario", "short.toml", "--spec", "agile.toml",
        timeout=None, cwd=directory,
    )  # fmt: skip
    return directory / "out", finished


def test_a_scenario_is_flown_with_its_checks_and_one_that_is_missed_is_exit_1(agile):
    """Pitch has an observer, roll has none: its check is missed, and all files are there all the same."""
    out, finished = agile
    assert finished.returncode == 1
    assert "1 of 2 checks failed: rms_ratio roll" in finished.stderr.splitlines()[-1]
    verdicts = {tuple(line.split()[:2]): line.split()[-1] for line in finished.stdout.splitlines()}
    assert verdicts["rms_ratio", "pitch"] == "ok"
    assert verdicts["rms_ratio", "roll"] == "FAILED"
    result = json.loads((out / "result.json").read_text())
    assert result["scenario"] == "short"
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "The paper shows the three attitude errors" not in page
    assert "rms_ratio roll" in page


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--scenario", "calm"), "scenario calm has no windows"),
        (("--scenario", "drydne"), "did you mean 'dryden'?"),
        (("--delay", "4"), "tuned specs are for 1, 2 and 3 samples"),
    ],
)
def test_what_the_demo_cannot_fly_is_one_line_and_nothing_is_written(tmp_path, arguments, words, capsys):
    finished = demo_here(capsys, "-o", tmp_path / "out", *arguments)
    assert finished.returncode == 2
    assert words in one_line(finished)
    assert not (tmp_path / "out").exists()


def test_a_spec_of_another_aircraft_is_flown_with_its_own_plant_and_controllers(agile):
    """What the design lacks flies the tail-sitter's axes."""
    out, _ = agile
    assert json.loads((out / "result.json").read_text())["axes"]["pitch"]["rms_ratio"] > 1.5
    assert "design.json says nothing of roll, yaw" in (out / "vehicle.log").read_text()
    (block,) = json.loads((out / "design.json").read_text())["blocks"]
    A, B, C = (np.array(block["problem"]["plant"][name]) for name in "ABC")
    with np.load(out / "flight.npz") as flight:
        rows = flight["window"] == 1
        moment, rate = (flight["u_e"] + flight["disturbance"])[rows, 1], flight["rate"][rows, 1]
    seen = np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(len(A))])
    x = np.linalg.solve(seen, free(A, B, C, moment, rate))
    assert simulated(A, B, C, x, moment) == pytest.approx(rate, abs=1e-6)


@pytest.mark.proof  # a search for weights
def test_the_spec_that_an_autopilots_parameters_give_is_tuned_and_flown(tmp_path):
    (tmp_path / "mild.toml").write_text(SHORT.partition("[[check]]")[0].replace("0.15", "0.05").replace("0.12", "0.04"))
    scenario = tmp_path / "mild.toml"
    result, _ = fly(tmp_path / "out", "--fast", "--scenario", scenario, "--spec", EXAMPLES / "px4_sih.toml")
    assert result["delay_samples"] == 2
    assert all(numbers["rms_ratio"] > 1.5 for numbers in result["axes"].values())


def free(A, B, C, moment, rate):
    """What the first rates owe to the state before them."""
    return rate[: len(A)] - simulated(A, B, C, np.zeros(len(A)), moment[: len(A)])


def simulated(A, B, C, x, moment):
    rates = []
    for u in moment:
        rates.append((C @ x).item())
        x = A @ x + B[:, 0] * u
    return np.array(rates)


def own_spec():
    return parse_spec((EXAMPLES / "tailsitter_paper.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("factor", [0.7, 1.0, 1.3])
def test_a_model_that_errs_as_models_do_is_flown(factor):
    spec = own_spec()
    assert is_tailsitter(replace(spec, blocks=tuple(scaled(block, factor) for block in spec.blocks)), spec)


@pytest.mark.parametrize("factor", [-1.0, 0.4, 2.0])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_a_plant_of_another_sign_or_size_in_any_axis_is_another_aircraft(factor, which):
    spec = own_spec()
    blocks = tuple(scaled(block, factor) if i == which else block for i, block in enumerate(spec.blocks))
    assert not is_tailsitter(replace(spec, blocks=blocks), spec)


def test_axes_in_another_order_or_coupled_are_another_aircraft():
    spec = own_spec()
    pitch, roll, yaw = spec.blocks
    swapped = (replace(pitch, plant=roll.plant), replace(roll, plant=pitch.plant), yaw)
    pair = Model(Entries(2, ((0, 0, pitch.plant), (1, 1, roll.plant), (0, 1, pitch.plant))), "pair")
    coupled = replace(pitch, axes=("pitch", "roll"), plant=pair)
    alone = replace(coupled, plant=Model(Entries(2, ((0, 0, pitch.plant), (1, 1, roll.plant))), "pair"))
    assert is_tailsitter(replace(spec, blocks=(alone, yaw)), spec)
    for other in (replace(spec, blocks=swapped), replace(spec, blocks=(coupled, yaw))):
        assert not is_tailsitter(other, spec)


def test_a_rate_that_the_vehicle_does_not_have_is_refused_before_anything_is_designed(tmp_path, capsys):
    spec = tmp_path / "fast.toml"
    spec.write_text((EXAMPLES / "tailsitter_paper.toml").read_text(encoding="utf-8").replace("250.0", "400.0"))
    finished = demo_here(capsys, "-o", tmp_path / "out", "--spec", spec)
    assert finished.returncode == 2
    assert f"{spec}: design.rate_hz is 400; the simulated vehicle has 250 Hz" in one_line(finished)
    assert not (tmp_path / "out").exists()


def scaled(block, factor):
    form = block.plant.form
    return replace(block, plant=replace(block.plant, form=replace(form, gain=factor * form.gain)))


def test_the_specs_that_the_package_brings_along_are_the_examples():
    for name in (PAPER, *TUNED.values()):
        assert packaged(name).read_bytes() == (EXAMPLES / name).read_bytes()


def test_the_result_table_shows_a_dash_where_there_is_no_ratio_and_no_paper():
    axes = {
        "roll": {"peak_off": 0.1, "peak_on": 0.05, "rms_off": 0.02, "rms_on": 0.01},
        "pitch": dict.fromkeys(("peak_off", "peak_on", "rms_off", "rms_on"), 0.0),
    }
    for numbers, ratio in zip(axes.values(), (2.0, None), strict=True):
        numbers |= {"peak_ratio": ratio, "rms_ratio": ratio, "paper_ratio": None}
    link = {"delay_samples": None, "rate_hz": 250.0, "samples_lost": 0, "samples": 500, "seed": 1, "clock": "lockstep"}
    _, head, roll, pitch, *_ = result_table({"axes": axes, **link}, 1).splitlines()
    assert head.split() == ["axis", "off", "on", "off/on", "off", "on", "off/on"]
    assert roll.split()[1:] == ["0.1000", "0.0500", "2.0", "0.02000", "0.01000", "2.0"]
    assert pitch.split()[1:] == ["0.0000", "0.0000", "–", "0.00000", "0.00000", "–"]
    assert max(map(len, (head, roll, pitch))) <= 80


@pytest.mark.proof
@pytest.mark.parametrize("scenario", ["dryden", "gust", "rotor"])
def test_a_packaged_scenario_meets_its_checks(scenario, tmp_path):
    result, finished = fly(tmp_path, "--fast", "--scenario", scenario)
    assert all(check["passed"] for check in result["checks"])
    assert "FAILED" not in finished.stdout


@pytest.mark.proof
def test_pitch_gains_at_least_eight_in_the_median_of_twenty_seeds(tmp_path):
    ratios = []
    for seed in range(1, 21):
        result, _ = fly(tmp_path / str(seed), "--fast", "--seed", str(seed))
        assert result["samples_lost"] == 0
        ratios.append(result["axes"]["pitch"]["rms_ratio"])
    middle = statistics.median(ratios)
    print(f"pitch RMS off/on over 20 seeds: median {middle:.2f}, {min(ratios):.2f}–{max(ratios):.2f}")
    assert middle >= 8.0


@pytest.mark.proof
def test_a_flight_in_real_time_agrees_with_lockstep(flown, tmp_path):
    """Within 10 % of each RMS: in real time a sample may be answered late, and the switch falls where it falls."""
    _, lockstep, _ = flown
    result, _ = fly(tmp_path, "--seed", "1")
    for axis, numbers in result["axes"].items():
        print(f"{axis}: real time {numbers['rms_ratio']:.2f}, lockstep {lockstep['axes'][axis]['rms_ratio']:.2f}")
        assert numbers["rms_on"] == pytest.approx(lockstep["axes"][axis]["rms_on"], rel=0.10)
