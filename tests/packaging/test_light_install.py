"""An aircraft installs numpy, pymavlink and pyserial: with nothing else importable it flies, and says what is missing.

Every distribution that those three do not bring along is refused to a real process by an import hook;
`test_wheel.py` shows the same in a fresh environment.
"""

import json
import re
import shlex
import subprocess
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, packages_distributions, requires

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from dob_companion.artifact import dumps
from dob_companion.cli.extras import remedy as of_the_companion
from dob_companion.cli.main import command_modules
from sitl.extras import remedy as of_the_vehicle
from tests.cli.processes import one_line
from tests.companion.aircraft import small_design
from tests.packaging.project import EXTRAS, PROJECT, ROOT, requirements
from tests.ports import free_port

_LIGHT = """
import json, runpy, sys

class Refuse:
    refused = frozenset(json.loads(sys.argv.pop(1)))
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in self.refused:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Refuse())
module = sys.argv.pop(1)
runpy.run_module(module, run_name="__main__", alter_sys=True)
"""

_EVERY_HELP = """
from dob_companion.cli.main import command_modules, main

for each in command_modules():
    print("#", name := each.__name__.rpartition(".")[2])
    try:
        main([name, "--help"])
    except SystemExit as left:
        assert not left.code, (name, left.code)
"""


def brought_along(distribution, found=frozenset()):
    """The names of a distribution and of all that it requires here, extras aside."""
    name = canonicalize_name(distribution)
    if name in found:
        return found
    found |= {name}
    try:
        needed = [Requirement(line) for line in requires(distribution) or ()]
    except PackageNotFoundError:
        return found
    for requirement in needed:
        if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
            found = brought_along(requirement.name, found)
    return found


@cache
def absent():
    """Top-level modules that a light install has not."""
    light = brought_along(PROJECT["name"])
    return sorted(
        module
        for module, distributions in packages_distributions().items()
        if light.isdisjoint(map(canonicalize_name, distributions))
    )


def run_light(*arguments, cwd, module="dob_companion"):
    return subprocess.run(
        [sys.executable, "-c", _LIGHT, json.dumps(absent()), module, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=60,
        cwd=cwd,
        check=False,
    )


@pytest.fixture
def design(tmp_path):
    path = tmp_path / "design.json"
    path.write_text(dumps(small_design())[0], encoding="utf-8")
    return path


def test_a_light_install_is_three_distributions_and_what_they_bring_along():
    assert {canonicalize_name(Requirement(line).name) for line in PROJECT["dependencies"]} == {
        "numpy",
        "pymavlink",
        "pyserial",
    }
    assert {"scipy", "control", "cvxpy", "clarabel", "matplotlib", "jinja2", "mavsdk", "rich"} <= set(absent())
    assert not {"numpy", "pymavlink", "serial", "dob_companion"} & set(absent())


def test_the_daemon_serves_without_any_extra(design, tmp_path):
    link = f"udpin:127.0.0.1:{free_port()}"
    finished = run_light("run", "--design", design, "--link", link, "--timeout", "0.2", "--json", cwd=tmp_path)
    assert finished.returncode == 1
    assert "no vehicle" in one_line(finished)
    assert any("listening" in json.loads(line).get("event", "") for line in finished.stdout.splitlines())


def test_the_simulated_vehicle_flies_without_any_extra(tmp_path):
    links = ("--link", f"udpout:127.0.0.1:{free_port()}", "--gcs", f"udpout:127.0.0.1:{free_port()}")
    finished = run_light("--clock", "lockstep", "--timeout", "0.2", *links, cwd=tmp_path, module="sitl")
    assert finished.returncode == 1
    assert "no answer to sample 0" in finished.stderr


def test_help_needs_no_extra(tmp_path):
    (tmp_path / "every_help.py").write_text(_EVERY_HELP)
    finished = run_light(cwd=tmp_path, module="every_help")
    assert finished.returncode == 0, finished.stderr
    _, *helps = finished.stdout.split("# ")
    assert [text.splitlines()[0] for text in helps] == [m.__name__.rpartition(".")[2] for m in command_modules()]
    assert all("example" in text for text in helps)


@pytest.mark.parametrize(
    "arguments",
    [
        ("design", "spec.toml", "-o", "out"),
        ("inspect", "design.json"),
        ("compare", "spec.toml"),
        ("param", "list"),
        ("status",),
        ("demo", "-o", "out"),
    ],
)
def test_a_command_of_another_wing_names_the_extra_that_brings_what_it_misses(arguments, design, tmp_path):
    finished = run_light(*arguments, cwd=tmp_path)
    assert finished.returncode == 2
    missing, extra, command = complaint(finished)
    assert canonicalize_name(packages_distributions()[missing][0]) in requirements(EXTRAS[extra])
    assert extra == "demo" or arguments[0] != "demo"
    assert command[:4] == [sys.executable, "-m", "pip", "install"]
    assert command[4:] == ["-c", f"{ROOT}/constraints.txt", "-e", f"{ROOT}[{extra}]"]
    assert not (tmp_path / "out").exists()


def complaint(finished):
    """What is missing, the extra that brings it, and the shell's words of the remedy."""
    missing, remedy = re.fullmatch(r"[\w-]+: (\w+) is not installed: (.*)", one_line(finished)).groups()
    return missing, re.search(r"\[(\w+)\]", remedy)[1], shlex.split(remedy)


@pytest.mark.parametrize("module", ["sitl", "sitl.sweep", "sitl.campaign"])
def test_help_of_the_vehicles_programs_needs_no_extra(module, tmp_path):
    finished = run_light("--help", cwd=tmp_path, module=module)
    assert finished.returncode == 0, finished.stderr
    assert "example" in finished.stdout


@pytest.mark.parametrize(
    ("module", "extra", "arguments"),
    [
        ("sitl.sweep", "design", ("-o", "out")),
        ("sitl.campaign", "campaign", ("--designs", "design.json", "-o", "out")),
        ("sitl.campaign", "campaign", ("replay", "out", "--flight", "0", "-o", "again")),
    ],
)
def test_a_program_of_the_vehicle_names_the_extra_that_it_needs(module, extra, arguments, design, tmp_path):
    finished = run_light(*arguments, cwd=tmp_path, module=module)
    assert finished.returncode == 2
    missing, named, _ = complaint(finished)
    assert named == extra
    assert canonicalize_name(packages_distributions()[missing][0]) in requirements(EXTRAS[extra])
    assert not (tmp_path / "out").exists()


def test_in_a_checkout_the_remedy_is_typed_as_it_stands(monkeypatch):
    """Relative to where one is, as after `make demo`; pip itself is not run here."""
    for made in (of_the_companion, of_the_vehicle):
        monkeypatch.chdir(ROOT)
        monkeypatch.setattr(sys, "executable", str(ROOT / ".venv" / "bin" / "python"))
        words = shlex.split(made(ModuleNotFoundError(name="scipy"), "design").partition(": ")[2])
        assert words == [".venv/bin/python", "-m", "pip", "install", "-c", "constraints.txt", "-e", ".[design]"]
        assert (ROOT / "constraints.txt").exists()
