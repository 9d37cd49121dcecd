"""The systemd unit, judged by systemd's own tools and our own command line, and the udev rule."""

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from dob_companion.cli.main import parser
from dob_companion.runtime.daemon import LONGEST_WAIT_S
from dob_companion.runtime.priority import PRIORITY

DEPLOY = Path(__file__).parents[2] / "deploy"
UNIT = (DEPLOY / "dob-companion.service").read_text()
RULES = (DEPLOY / "60-dob-companion.rules").read_text()
needs_systemd = pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="apt install systemd")

EXPOSURE = 16
"""Tenths, as docs/operations.md states it; `systemd-analyze security` calls up to 4.0 "OK"."""


@pytest.fixture
def installed(tmp_path):
    """The unit with a program that exists here."""
    path = tmp_path / "dob-companion.service"
    path.write_text(UNIT.replace("ExecStart=dob-companion", f"ExecStart={sys.executable} -m dob_companion"))
    return path


def setting(name):
    (value,) = re.findall(rf"^{name}=(.*)$", UNIT, re.MULTILINE)
    return value


def analyze(*arguments):
    return subprocess.run(["systemd-analyze", *arguments], capture_output=True, text=True, check=False)


@needs_systemd
def test_systemd_finds_nothing_wrong_with_the_unit(installed):
    verified = analyze("verify", "--man=no", str(installed))
    assert (verified.returncode, verified.stdout + verified.stderr) == (0, "")


@needs_systemd
def test_the_exposure_level_is_what_the_manual_states(installed):
    judged = analyze("security", "--offline=true", f"--threshold={EXPOSURE}", str(installed))
    assert judged.returncode == 0, judged.stdout[-300:]
    worse = analyze("security", "--offline=true", f"--threshold={EXPOSURE - 1}", str(installed))
    assert worse.returncode != 0
    assert f"{EXPOSURE / 10:.1f}" in (DEPLOY.parent / "docs" / "operations.md").read_text()


def test_the_command_of_the_unit_is_one_that_the_program_has():
    program, *arguments = shlex.split(
        re.search(r"^ExecStart=((?:.*\\\n)*.*)$", UNIT, re.MULTILINE)[1].replace("\\\n", "")
    )
    assert program == "dob-companion"
    assert parser().parse_args(arguments).command == "run"


def test_the_numbers_of_the_unit_fit_the_program():
    assert int(setting("LimitRTPRIO")) >= PRIORITY
    assert float(setting("WatchdogSec")) >= 5 * LONGEST_WAIT_S
    assert (setting("Type"), setting("Restart"), setting("RestartSec")) == ("notify", "always", "1")
    assert "dialout" in setting("SupplementaryGroups")


def test_the_files_that_the_unit_reads_are_those_that_the_package_installs():
    recipe = (DEPLOY / "build-deb").read_text()
    for path in ("/etc/dob-companion/dob-companion.toml", "/etc/default/dob-companion"):
        assert path in UNIT
        assert path.lstrip("/") in recipe


def test_every_udev_rule_is_well_formed_and_jumps_to_a_label_below():
    rules = [line for line in RULES.splitlines() if line and not line.startswith("#")]
    labels = [number for number, line in enumerate(rules) if line.startswith("LABEL=")]
    for number, line in enumerate(rules):
        for token in line.split(", "):
            assert re.fullmatch(r'[A-Z_]+(\{\w+\})?(==|!=|\+=|=)"[^"]*"', token), token
        goto = re.search(r'GOTO="(\w+)"', line)
        if goto:
            assert any(rules[label] == f'LABEL="{goto[1]}"' for label in labels if label > number)
