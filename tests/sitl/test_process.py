"""The simulated vehicle as a process, over real sockets, with a companion that answers zeros."""

import json
import shlex
import signal
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from tests.cli.processes import PATIENCE_S
from tests.sitl.bench import Sitl, short_scenario

LOCKSTEP = ("--clock", "lockstep")


def fly(tmp_path: Path, name: str, *arguments: str) -> tuple[list[bytes], Path]:
    out = tmp_path / name
    with Sitl(short_scenario(tmp_path), *LOCKSTEP, "-o", str(out), *arguments) as sitl:
        code, err = sitl.finish()
        assert code == 0, err
        return sitl.pairs, out


def without_repeats(pairs: list[bytes]) -> list[bytes]:
    """Samples may be sent again on a slow machine, unchanged; each once, in order."""
    return list(dict.fromkeys(pairs))


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """The process of one flight, ended, and where it left its files."""
    directory = tmp_path_factory.mktemp("flown")
    with Sitl(short_scenario(directory), *LOCKSTEP, "-o", str(directory / "out")) as sitl:
        code, err = sitl.finish()
        assert code == 0, err
    return sitl, directory / "out"


def test_a_lockstep_flight_is_the_same_bytes_every_time(flown, tmp_path):
    first, out = flown[0].pairs, flown[1]
    second, again = fly(tmp_path, "again")
    assert len(without_repeats(first)) > 1000
    assert without_repeats(first) == without_repeats(second)
    assert (out / "result.json").read_bytes() == (again / "result.json").read_bytes()
    assert (out / "flight.npz").read_bytes() == (again / "flight.npz").read_bytes()


def test_arming_from_the_ground_gives_the_same_flight_as_arming_itself(flown, tmp_path):
    armed, awaited = fly(tmp_path, "b", "--await-arming")
    assert without_repeats(flown[0].pairs) == without_repeats(armed)
    assert (flown[1] / "result.json").read_bytes() == (awaited / "result.json").read_bytes()


def test_what_a_flight_leaves_behind(flown):
    pairs, out = flown[0].pairs, flown[1]
    result = json.loads((out / "result.json").read_text())
    assert result["schema"] == "dob-companion/flight-result/1"
    assert (result["scenario"], result["seed"], result["clock"]) == ("short", 1, "lockstep")
    assert (result["rate_hz"], result["delay_samples"], result["samples"], result["samples_lost"]) == (250.0, 1, 500, 0)
    for axis, peak in (("roll", 0.15), ("pitch", 0.12), ("yaw", 0.12)):
        assert result["axes"][axis]["peak_off"] == pytest.approx(peak, rel=1e-4)
    log = np.load(out / "flight.npz")
    n = len(log["stamp_us"])
    assert set(np.diff(log["stamp_us"])) == {4000}
    assert log["answered"].all()
    assert {k: log[k].shape for k in log.files if log[k].ndim == 2} == {
        "rate": (n, 3),
        "gyro": (n, 3),
        "u_e": (n, 3),
        "correction": (n, 3),
        "disturbance": (n, 3),
        "attitude_error": (n, 3),
        "rate_setpoint": (n, 3),
        "quaternion": (n, 4),
        "position": (n, 3),
        "wind": (n, 3),
        "moment": (n, 3),
    }
    assert (log["age"][0], set(log["age"][1:])) == (-1, {1})
    np.testing.assert_allclose(np.linalg.norm(log["quaternion"], axis=1), 1.0, atol=1e-12)
    wire = [
        mavlink.MAVLink_highres_imu_message.unpacker.unpack(p.ljust(63, b"\0")) for p in without_repeats(pairs)[::2]
    ]
    np.testing.assert_array_equal([w[4:7] for w in wire], log["gyro"])


def test_the_ground_station_is_told_how_the_flight_goes(flown):
    expected = ["hover reached", "window off", "waiting for DOB_ENABLE=1", "window on", "flight complete"]
    assert list(dict.fromkeys(flown[0].texts)) == [f"sitl: {t}" for t in expected]
    beats = [m for m in flown[0].at_ground if m.get_type() == "HEARTBEAT"]
    assert all(m.base_mode & mavlink.MAV_MODE_FLAG_HIL_ENABLED for m in beats)


def test_a_flight_whose_notes_nobody_reads_any_more_is_flown_to_its_end_and_another_seed_is_another_flight(
    flown, tmp_path
):
    with Sitl(short_scenario(tmp_path), *LOCKSTEP, "--seed", "4", "-o", str(tmp_path / "out")) as sitl:
        sitl.process.stderr.close()
        sitl.run()
        assert sitl.process.wait(PATIENCE_S) == 0
        sitl.process.stderr = None
    assert json.loads((tmp_path / "out" / "result.json").read_text())["samples"] == 500
    assert without_repeats(sitl.pairs) != without_repeats(flown[0].pairs)


@pytest.mark.parametrize(
    ("redirection", "code", "err"),
    [
        ("| true", 0, ""),
        (">&- 2>&-", 0, ""),
        ("> /dev/full", 1, "sitl: standard output cannot be written: No space left on device\n"),
    ],
)
def test_a_result_that_nobody_reads_is_no_error_and_one_that_is_lost_is(redirection, code, err):
    command = f"{shlex.quote(sys.executable)} -m sitl calm --about {redirection}"
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stderr) == (code, err)


def test_in_real_time_it_flies_the_same_scenario(tmp_path):
    with Sitl(short_scenario(tmp_path), "-o", str(tmp_path / "out")) as sitl:
        code, err = sitl.finish()
    assert code == 0, err
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert (result["clock"], result["rate_hz"], result["samples"]) == ("real-time", 250.0, 500)
    assert result["axes"]["pitch"]["peak_off"] == pytest.approx(0.12, rel=0.01)


def test_sample_zero_repeats_unchanged_until_the_companion_is_there():
    with Sitl(*LOCKSTEP) as sitl:
        sitl.answering = False
        sitl.run(lambda: len(sitl.pairs) >= 8)
        assert len(set(sitl.pairs)) == 2
        sitl.answering = True
        sitl.run(lambda: len(set(sitl.pairs)) > 100)


def test_while_the_clock_stands_the_newest_pair_is_a_sign_of_life():
    with Sitl(*LOCKSTEP, "--await-arming") as sitl:
        sitl.obeying = False
        sitl.run(lambda: len(sitl.pairs) >= 10)
        assert len(set(sitl.pairs)) == 2
        assert "sitl: waiting for arm" in sitl.texts


def test_without_a_companion_lockstep_ends_after_its_timeout():
    with Sitl(*LOCKSTEP, "--timeout", "0.5") as sitl:
        sitl.answering = False
        code, err = sitl.finish()
    assert code == 1
    assert "no answer to sample 0 for 0.5 s" in err


def test_lockstep_says_what_it_waits_for_and_how_to_start_it():
    with Sitl(*LOCKSTEP, "--timeout", "2.5") as sitl:
        sitl.answering = False
        _, err = sitl.finish()
        port = sitl.companion.socket.getsockname()[1]
    assert f"sitl: waiting for a companion: dob-companion run --design FILE --link udpin:127.0.0.1:{port}\n" in err


def test_what_a_scenario_is_can_be_asked_without_flying_it():
    def about(name):
        asked = [sys.executable, "-m", "sitl", name, "--about"]
        return subprocess.run(asked, capture_output=True, text=True, check=False)

    dryden, calm = (json.loads(about(name).stdout) for name in ("dryden", "calm"))
    assert (dryden["scenario"], dryden["airframe"], dryden["checks"]) == ("dryden", "tailsitter", 6)
    assert dryden["seconds"] == pytest.approx(2 * 40 + 15, abs=10)
    assert (calm["seconds"], calm["checks"]) == (None, 0)
    assert about("drydne").returncode == 2


def test_a_companion_that_falls_silent_ends_a_lockstep_flight():
    with Sitl(*LOCKSTEP) as sitl:
        sitl.run(lambda: len(sitl.pairs) > 500)
        sitl.answering = False
        code, err = sitl.finish()
        assert len(sitl.pairs) > 500 + 2 * 20  # the last pair was sent again and again
    assert code == 1
    assert "for 5 s; expected one from component 191" in err


def test_an_observer_that_is_on_too_early_ends_the_flight(tmp_path):
    with Sitl(short_scenario(tmp_path), *LOCKSTEP, "-o", str(tmp_path / "out")) as sitl:
        sitl.run(lambda: len(sitl.pairs) > 0)
        sitl.report_enable(1.0)
        code, err = sitl.finish()
    assert code == 1
    assert [line for line in err.splitlines() if "DOB_ENABLE" in line] == [err.splitlines()[-1]]
    assert not (tmp_path / "out").exists()


def test_an_event_that_never_comes_ends_the_flight(tmp_path):
    with Sitl(short_scenario(tmp_path), *LOCKSTEP, "--event-timeout", "0.5") as sitl:
        sitl.obeying = False
        code, err = sitl.finish()
    assert code == 1
    assert err.splitlines()[-1] == "sitl: nothing came for 0.5 s; expected DOB_ENABLE=1 from the ground station"


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 0), (signal.SIGINT, 130)])
@pytest.mark.parametrize("clock", ["real-time", "lockstep"])
def test_a_signal_ends_it_cleanly_at_any_moment(number, code, clock):
    with Sitl("--clock", clock) as sitl:
        sitl.run(lambda: len(sitl.pairs) > 40)
        sitl.process.send_signal(number)
        ended, err = sitl.finish()
    assert ended == code
    assert "Traceback" not in err


def test_still_air_is_recorded_until_it_is_stopped(tmp_path):
    with Sitl(*LOCKSTEP, "-o", str(tmp_path)) as sitl:
        sitl.run(lambda: len(sitl.pairs) > 1000)
        sitl.process.send_signal(signal.SIGTERM)
        sitl.finish()
    assert len(np.load(tmp_path / "flight.npz")["stamp_us"]) >= 500
    assert not (tmp_path / "result.json").exists()


def run_once(*arguments: str) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, "-m", "sitl", *arguments],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    return done.returncode, done.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("papper",), "did you mean 'paper'"),
        (("nowhere.toml",), "nowhere.toml"),
        (("--link", "upd:127.0.0.1:1"), "expected udpin:HOST:PORT"),
        (("--gcs", "tcp:127.0.0.1"), "expected udpin:HOST:PORT"),
        (("--seed", "-1"), "--seed"),
        (("-o", __file__), "expected a directory"),
    ],
)
def test_what_cannot_begin_says_so_in_one_line_and_returns_two(arguments, message):
    code, err = run_once(*arguments)
    assert code == 2
    assert message in err.splitlines()[-1]
    assert "Traceback" not in err


def test_a_port_in_use_returns_two():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as holder:
        holder.bind(("127.0.0.1", 0))
        url = f"udpin:127.0.0.1:{holder.getsockname()[1]}"
        code, err = run_once("--link", url)
    assert (code, len(err.splitlines())) == (2, 1)
    assert url in err
