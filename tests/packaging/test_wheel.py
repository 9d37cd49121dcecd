"""The wheel, built from what git tracks and installed outside the checkout."""

import json
import os
import subprocess
import sys
import zipfile

import pytest

from dob_companion.artifact import dumps
from tests.cli.processes import UdpVehicle, one_line, wait_for
from tests.companion.aircraft import small_design
from tests.packaging.project import PROJECT, ROOT, clean_copy, requirements
from tests.ports import free_port

pytestmark = pytest.mark.proof

PIP = ("-m", "pip", "--quiet", "--disable-pip-version-check")
PINNED = ("--constraint", ROOT / "constraints.txt")


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    return clean_copy(tmp_path_factory.mktemp("source"))


@pytest.fixture(scope="module")
def wheel(source, tmp_path_factory):
    out = tmp_path_factory.mktemp("wheel")
    subprocess.run([sys.executable, *PIP, "wheel", "--no-deps", "--wheel-dir", out, source], check=True)
    (built,) = out.glob("*.whl")
    return built


def installed(wheel, extras, folder):
    """A fresh environment with the wheel and the extras; returns its interpreter."""
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    python = folder / "bin" / "python"
    subprocess.run([python, *PIP, "install", *PINNED, f"{wheel}{extras}"], check=True)
    return python


@pytest.fixture(scope="module")
def light(wheel, tmp_path_factory):
    return installed(wheel, "", tmp_path_factory.mktemp("light"))


@pytest.fixture(scope="module")
def full(wheel, tmp_path_factory):
    return installed(wheel, "[demo]", tmp_path_factory.mktemp("full"))


def call(python, *arguments, cwd):
    return subprocess.run([python, "-m", *arguments], cwd=cwd, capture_output=True, text=True, timeout=300, check=False)


def test_the_wheel_holds_every_file_of_both_packages_and_the_examples(wheel, source):
    held = set(zipfile.ZipFile(wheel).namelist())
    packages = {
        str(f.relative_to(source)) for p in ("dob_companion", "sitl") for f in (source / p).rglob("*") if f.is_file()
    }
    data = f"dob_companion-{wheel.name.split('-')[1]}.data/data/share/dob-companion/examples"
    examples = {f"{data}/{f.name}" for f in (source / "examples").glob("*.toml")}
    assert len(examples) > 0
    extra = {name for name in held if ".dist-info/" not in name}
    assert extra == packages | examples


def test_alone_it_brings_no_solver_no_plots_and_no_client(light):
    names = "from importlib.metadata import distributions as d; print(*(each.name.lower() for each in d()))"
    there = set(subprocess.run([light, "-c", names], capture_output=True, text=True, check=True).stdout.split())
    assert set(requirements(PROJECT["dependencies"])) <= there
    assert not {"scipy", "control", "cvxpy", "clarabel", "matplotlib", "jinja2", "mavsdk", "rich"} & there


def test_alone_it_answers_a_vehicle(light, tmp_path):
    design = tmp_path / "design.json"
    design.write_text(dumps(small_design())[0], encoding="utf-8")
    port = free_port()
    command = [light.with_name("dob-companion"), "run", "--design", design, "--link", f"udpin:127.0.0.1:{port}"]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process:
        try:
            wait_for(process.stderr, "listening")
            with UdpVehicle(port) as vehicle:
                assert vehicle.activate().fly(1)[0].x == pytest.approx(-0.2, abs=1e-3)
                process.terminate()
                last = vehicle.last_correction(process)
        finally:
            process.kill()
    assert (last.x, last.y, last.z) == (0.0, 0.0, 0.0)
    assert process.returncode == 0


def test_alone_it_names_the_extra_that_designs(light, tmp_path):
    finished = call(light, "dob_companion", "design", "x.toml", "-o", "y", cwd=tmp_path)
    assert finished.returncode == 2
    assert one_line(finished).endswith("install dob-companion again, with its extra [design]")


def test_the_demo_flies_outside_the_checkout(full, tmp_path):
    finished = call(full, "dob_companion", "demo", "--fast", "-o", "out", cwd=tmp_path)
    assert finished.returncode == 0, finished.stderr
    for name in ("design.json", "result.json", "report.html", "flight.png"):
        assert (tmp_path / "out" / name).stat().st_size > 0
    assert json.loads((tmp_path / "out" / "result.json").read_text())["samples_lost"] == 0


def test_wherever_pip_puts_it_the_demo_has_its_spec(wheel, source, tmp_path):
    """As with `--user` and `--target`, where nothing of the prefix can be relied on."""
    subprocess.run([sys.executable, *PIP, "install", "--no-deps", "--target", tmp_path / "here", wheel], check=True)
    ask = "from dob_companion.cli import demo; print(demo.__file__, demo.packaged(demo.PAPER).read_text(), sep='\\n')"
    paths = {"PYTHONPATH": str(tmp_path / "here"), "PATH": os.environ["PATH"]}
    said = subprocess.run([sys.executable, "-P", "-c", ask], env=paths, capture_output=True, text=True, check=True)
    where, _, spec = said.stdout.partition("\n")
    assert where.startswith(str(tmp_path / "here"))
    assert spec.rstrip() == (source / "examples" / "tailsitter_paper.toml").read_text().rstrip()


def test_the_simulated_vehicle_knows_its_scenarios_outside_the_checkout(full, tmp_path):
    listed = call(full, "sitl", "--help", cwd=tmp_path)
    assert listed.returncode == 0, listed.stderr
    for scenario in (ROOT / "sitl" / "scenarios").glob("*.toml"):
        assert scenario.stem in listed.stdout
