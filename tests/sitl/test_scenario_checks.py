"""Checks: each measure against numbers made by hand, bounds by delay, and what a failed one does."""

import json
import sys

import numpy as np
import pytest

from sitl.cli import save
from sitl.flight import Flight
from sitl.scenario.checks import STATES, judge, lines, read_checks
from sitl.scenario.script import Phase
from sitl.scenario.spec import load, packaged_names
from sitl.scenario.tables import Table
from tests.sitl.bench import SHORT, Sitl

N = 500


def flight(**columns: np.ndarray) -> dict[str, np.ndarray]:
    """Two windows of two seconds: a sine of 0.1 rad off, of 0.02 on; the correction is a tenth of u_e less itself."""
    t = np.arange(N) * 0.004
    sine = np.sin(2.0 * np.pi * t)[:, None] * np.ones(3)
    arrays = {
        "window": np.repeat([1, 2], N),
        "attitude_error": np.concatenate([0.5 + 0.1 * sine, 0.02 * sine]),
        "rate_setpoint": np.concatenate([0.1 * sine, 0.02 * sine]),
        "rate": np.zeros((2 * N, 3)),
        "u_e": np.concatenate([sine, 1.1 * sine]),
        "correction": np.concatenate([0.0 * sine, 0.1 * sine]),
        "position": np.zeros((2 * N, 3)),
        "age": np.full(2 * N, 2),
        "answered": np.arange(2 * N) % 4 > 0,
        "state": np.where(np.arange(2 * N) % 5 == 0, STATES.index("ACTIVE"), -1),
    }
    return arrays | columns


def check(delay: int = 1, arrays: dict | None = None, **keys: object) -> list:
    table = Table("file.toml", "check[1]", {"measure": "rms_ratio", "at_least": 0.0} | keys)
    return judge(read_checks([table], 2.0), arrays or flight(), delay)


@pytest.mark.parametrize(
    ("measure", "value"),
    [
        ("rms_ratio", 5.0),
        ("peak_ratio", 5.0),
        ("rms_off", 0.1 / np.sqrt(2.0)),
        ("peak_on", 0.02),
        ("correction", 0.1),
        ("command_leak", 0.1),
        ("rate_ratio", 5.0),
    ],
)
def test_a_measure_with_axes_is_checked_on_each_unless_one_is_named(measure, value):
    assert [v.value for v in check(measure=measure)] == pytest.approx([value] * 3, rel=1e-4)
    (one,) = check(measure=measure, axis="pitch")
    assert one.name == f"{measure} pitch"


@pytest.mark.parametrize(
    ("measure", "value"),
    [("largest_error", 0.6), ("delay_samples", 2.0), ("lost", 0.25), ("drift_m", 0.0)],
)
def test_a_measure_of_the_whole_vehicle_is_one_number(measure, value):
    (verdict,) = check(measure=measure)
    assert verdict.value == pytest.approx(value, rel=1e-3)


def test_the_state_is_a_share_of_the_samples_that_told_it():
    state = np.full(2 * N, -1)
    state[-100::5] = STATES.index("FAULT")
    state[N:-100:5] = STATES.index("ACTIVE")
    told = flight(state=state)
    assert check(arrays=told, measure="state", state="FAULT")[0].value == pytest.approx(0.2)
    assert check(arrays=told, measure="state", state="FAULT", from_s=1.7)[0].value == 1.0
    (none,) = check(arrays=flight(state=np.full(2 * N, -1)), measure="state", state="FAULT")
    assert (none.value, none.passed) == (None, False)


def test_a_part_of_the_window_is_cut_out():
    correction = np.zeros((2 * N, 3))
    correction[N + 250 :, 1] = 0.2
    arrays = flight(correction=correction)
    found = [
        check(arrays=arrays, measure="correction", axis="pitch", **span)[0] for span in ({"to_s": 1.0}, {"from_s": 1.0})
    ]
    assert [(v.name, v.value) for v in found] == [("correction pitch 0–1 s", 0.0), ("correction pitch from 1 s", 0.2)]


@pytest.mark.parametrize(
    ("delay", "bound", "passed"), [(1, 6.0, False), (2, 4.0, True), (3, 5.5, False), (9, 5.5, False)]
)
def test_a_list_of_bounds_is_by_link_delay_and_the_last_holds_for_longer_ones(delay, bound, passed):
    (verdict,) = check(delay, axis="roll", at_least=[6.0, 4.0, 5.5])
    assert (verdict.at_least, verdict.passed) == (bound, passed)


def test_an_upper_bound_is_a_bound():
    assert [check(axis="roll", at_most=bound)[0].passed for bound in (4.9, 5.1)] == [False, True]


def test_an_axis_without_any_error_has_no_ratio_and_fails_its_check():
    error = np.zeros((2 * N, 3))
    (verdict,) = check(arrays=flight(attitude_error=error), axis="roll")
    assert (verdict.value, verdict.passed) == (None, False)


def test_the_table_for_people_says_which_failed():
    text = lines(check(axis="roll", at_least=6.0))
    assert text[0].split() == ["check", "value", "at", "least", "at", "most"]
    assert text[1].split() == ["rms_ratio", "roll", "5", "6", "–", "FAILED"]


def fly(tmp_path, checks: str, *more: str) -> tuple[int, str, dict]:
    path = tmp_path / "checked.toml"
    path.write_text(SHORT + checks)
    out = tmp_path / "out"
    with Sitl(str(path), "--clock", "lockstep", "-o", str(out), *more) as sitl:
        code, err = sitl.finish()
    return code, err, json.loads((out / "result.json").read_text())


def test_a_check_that_fails_ends_in_exit_code_one_and_its_name_and_the_files_are_there_all_the_same(tmp_path):
    """A companion that answers zeros improves nothing: off and on are the same."""
    pair = '[[check]]\nmeasure = "rms_ratio"\naxis = "{}"\nat_least = {}\n'
    code, err, result = fly(tmp_path, pair.format("roll", 0.9) + pair.format("pitch", 2.0), "--delay", "3")
    assert code == 1
    assert err.splitlines()[-1] == "sitl: 1 of 2 checks failed: rms_ratio pitch"
    assert [c["passed"] for c in result["checks"]] == [True, False]
    assert result["checks"][1]["check"] == "rms_ratio pitch"
    assert result["checks"][1]["value"] == pytest.approx(result["axes"]["pitch"]["rms_ratio"])
    assert result["delay_samples"] == 3
    assert (tmp_path / "out" / "figure.png").read_bytes().startswith(b"\x89PNG")


def test_without_matplotlib_all_but_the_figure_is_written_and_its_lack_is_said(tmp_path, monkeypatch, capsys):
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    flight = Flight(load(str(path)), 1)
    while not flight.complete:
        flight.step()
        if flight.script.phase is Phase.WAIT_OBSERVER:
            flight.script.observer_reported(True)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    save(flight, "lockstep", tmp_path / "out", drawn=True)
    said = capsys.readouterr().err
    assert said.startswith("sitl: no figure: matplotlib is not installed: ")
    assert said.count("\n") == 1
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"flight.npz", "result.json"}


@pytest.mark.parametrize("name", packaged_names())
def test_a_packaged_scenario_states_one_bound_for_each_axis_and_time(name):
    stated = [(c.measure, axis, c.from_s, c.to_s, c.state) for c in load(name).checks for axis in c.axes or ("",)]
    assert len(stated) == len(set(stated))
