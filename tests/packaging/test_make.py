"""`make` sets itself up, and where a package of the system is missing one line names it."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys

import pytest

from tests.packaging.project import ROOT, clean_copy

TOOLS = ("git", "make", "rm", "find", "touch")


def make(target, path, venv):
    return subprocess.run(
        [shutil.which("make"), "--no-print-directory", f"VENV={venv}", target.format(venv=venv)],
        cwd=ROOT,
        env={"PATH": str(path), "LC_ALL": "C.UTF-8"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.fixture
def machine(tmp_path):
    """A PATH of its own, with python3 being this interpreter."""
    path = tmp_path / "bin"
    path.mkdir()
    for name in TOOLS:
        (path / name).symlink_to(shutil.which(name))
    script(path / "python3", f'exec {sys.executable} "$@"')
    return path


def script(file, body):
    file.write_text(f"#!/bin/sh\n{body}\n", encoding="utf-8")
    file.chmod(0o755)


def only_complaint(finished):
    """The single line before make's own."""
    assert finished.returncode != 0
    line, summary = finished.stderr.strip().splitlines()
    assert summary.startswith("make: ***")
    assert finished.stdout == ""
    return line


@pytest.mark.parametrize("tool", ["git", "python3"])
@pytest.mark.parametrize("target", ["demo", "test"])
def test_a_missing_tool_is_named_with_its_package(machine, tmp_path, tool, target):
    (machine / tool).unlink()
    assert only_complaint(make(target, machine, tmp_path / "venv")) == f"{tool} is missing: apt install {tool}"


def test_a_python_without_ensurepip_needs_python3_venv(machine, tmp_path):
    without = 'import sys; sys.modules["ensurepip"] = None; exec(sys.argv[1])'
    script(machine / "python3", f"shift; exec {sys.executable} -c '{without}' \"$1\"")
    assert (
        only_complaint(make("demo", machine, tmp_path / "venv")) == "python3-venv is missing: apt install python3-venv"
    )
    assert not (tmp_path / "venv").exists()


def test_an_old_python_is_named_with_what_was_expected(machine, tmp_path):
    old = "import sys; sys.version_info = (3, 9, 2); exec(sys.argv[1])"
    script(
        machine / "python3",
        f'[ "$1" = --version ] && echo Python 3.9.2 && exit\nshift; exec {sys.executable} -c \'{old}\' "$1"',
    )
    line = only_complaint(make("demo", machine, tmp_path / "venv"))
    assert line.startswith("python3 is Python 3.9.2, expected 3.11 or newer")


@pytest.mark.proof
def test_a_set_up_interrupted_at_any_moment_is_completed_by_calling_make_again(tmp_path):
    """Ctrl-C while pip is unpacking, three times, each a little later; then make once more.

    At last a package as pip leaves it when stopped within: that is left to chance above.
    """
    checkout = clean_copy(tmp_path / "checkout")
    venv = checkout / ".venv"
    environment = {"PATH": os.environ["PATH"], "LC_ALL": "C.UTF-8"}
    command = [shutil.which("make"), "--no-print-directory", ".venv/.demo"]
    for unpacked in (1, 10, 25):
        process = subprocess.Popen(command, cwd=checkout, env=environment, start_new_session=True)
        while len(list(venv.glob("lib/python3*/site-packages/*.dist-info"))) < unpacked:
            with contextlib.suppress(subprocess.TimeoutExpired):
                pytest.fail(f"set-up ended by itself with exit code {process.wait(0.05)}")
        os.killpg(process.pid, signal.SIGINT)
        assert process.wait(60) != 0
        assert not (venv / ".demo").exists()
    subprocess.run(command, cwd=checkout, env=environment, check=True)
    (packages,) = venv.glob("lib/python3*/site-packages")
    next(packages.glob("rich-*.dist-info/RECORD")).unlink()  # the last file that pip writes
    shutil.rmtree(packages / "rich")
    (venv / ".demo").unlink()
    subprocess.run(command, cwd=checkout, env=environment, check=True)
    assert [d for d in packages.glob("*.dist-info") if not (d / "RECORD").exists()] == []
    modules = (
        "import clarabel, control, cvxpy, jinja2, matplotlib.pyplot, mavsdk, numpy, pymavlink, rich, scipy, serial"
    )
    subprocess.run([venv / "bin" / "python", "-c", modules], check=True)
    subprocess.run([venv / "bin" / "dob-companion", "--version"], check=True)
