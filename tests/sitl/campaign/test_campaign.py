"""A campaign on this computer, from end to end."""

import json
import signal
import subprocess

import numpy as np
import psutil
import pytest

from tests.cli.processes import PATIENCE_S
from tests.sitl.campaign.processes import COMMAND, FLIGHTS, arguments, kept, run, wait_for


def test_each_flight_leaves_one_row(flown):
    out, _, rows = flown
    assert [row["flight"] for row in rows] == list(range(FLIGHTS))
    assert {row["outcome"] for row in rows} == {"complete"}
    assert {row["delay_samples"] - row["delay"] for row in rows} == {0}
    assert all(row[f"rms_off_{axis}"] > row[f"rms_on_{axis}"] > 0 for row in rows for axis in ("roll", "pitch", "yaw"))
    assert {path.name for path in out.iterdir()} == {
        "campaign.json",
        "designs",
        "flights.parquet",
        "index.html",
        "scenario",
    }


def test_the_summary_is_the_rows_own(flown):
    _, summary, rows = flown
    assert (summary["flights"], summary["flown"], summary["failed"]) == (FLIGHTS, FLIGHTS, 0)
    (group,) = [g for g in summary["groups"] if g["inputs"] == {"design": "a", "delay": 2}]
    ratios = [row["rms_ratio_pitch"] for row in rows if (row["design"], row["delay"]) == ("a", 2)]
    assert group["flights"] == len(ratios) == 2
    assert group["axes"]["pitch"]["rms_ratio"]["median"] == pytest.approx(np.median(ratios))
    assert group["axes"]["pitch"]["rms_ratio"]["min"] == min(ratios)
    least = [min(row[f"rms_ratio_{axis}"] for axis in ("roll", "pitch", "yaw")) for row in summary["worst"]]
    assert least == sorted(least)
    assert least[0] == min(row[f"rms_ratio_{axis}"] for row in rows for axis in ("roll", "pitch", "yaw"))


def test_the_same_design_under_two_names_flies_the_same_flights(flown):
    _, _, rows = flown
    own = {"flight", "design"}
    first, second = ([{k: v for k, v in r.items() if k not in own} for r in rows if r["design"] == d] for d in "ab")
    assert first == second


def test_a_flight_replays_to_the_same_numbers_by_the_pages_own_command(flown, tmp_path):
    out, summary, rows = flown
    worst = summary["worst"][0]
    page = (out / "index.html").read_text("utf-8")
    command = f"replay {out} --flight {worst['flight']} -o flight-{worst['flight']}"
    assert f"<code>python -m sitl.campaign {command}</code>" in page
    finished = subprocess.run([*COMMAND, *command.split(), "--json"], capture_output=True, cwd=tmp_path, check=True)
    assert json.loads(finished.stdout) == rows[worst["flight"]] == worst
    record = tmp_path / f"flight-{worst['flight']}"
    result = json.loads((record / "result.json").read_text())
    assert result["axes"]["yaw"]["rms_on"] == worst["rms_on_yaw"]
    with np.load(record / "flight.npz") as flight:
        on = flight["window"] == 2
        assert np.abs(flight["correction"][on, 1]).max() == worst["max_correction_pitch"]


@pytest.mark.proof
def test_killed_and_started_again_it_flies_only_what_is_missing_and_ends_the_same(design, short, flown, tmp_path):
    whole, _, _ = flown
    out = tmp_path / "dir"
    command = arguments(design, short, out, "--processes", 2)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        wait_for(lambda: len(kept(out)) >= 3, process)
        workers = psutil.Process(process.pid).children(recursive=True)
        process.send_signal(signal.SIGKILL)
    assert not psutil.wait_procs(workers, timeout=PATIENCE_S)[1], "workers outlive a campaign that was killed"
    before = len(kept(out))
    assert before < FLIGHTS
    again = run(command)
    assert again.returncode == 0, again.stderr
    there, flew, page = again.stderr.splitlines()  # and no progress, in a pipe
    assert there == f"campaign: {before} of {FLIGHTS} flights are there already"
    assert flew.startswith(f"campaign: {FLIGHTS - before} flights in ")
    assert page == f"campaign: {out / 'index.html'}"
    assert (out / "flights.parquet").read_bytes() == (whole / "flights.parquet").read_bytes()
    assert not (out / "parts").exists()


@pytest.mark.proof
def test_a_worker_process_that_is_killed_costs_no_flight(design, short, flown, tmp_path):
    whole, _, _ = flown
    out = tmp_path / "dir"
    command = arguments(design, short, out, "--processes", 2)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        wait_for(lambda: len(kept(out)) >= 1, process)
        busiest = max(psutil.Process(process.pid).children(), key=lambda child: child.cpu_times().user)
        busiest.kill()
        _, errors = process.communicate(timeout=PATIENCE_S)
        assert process.returncode == 0, errors
    assert (out / "flights.parquet").read_bytes() == (whole / "flights.parquet").read_bytes()
