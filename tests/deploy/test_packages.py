"""The Debian package and the wheels of other processors. Long, and in need of a package index: `make proof`."""

import hashlib
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.proof


def made(target, *variables):
    finished = subprocess.run(
        ["make", "--silent", target, *variables], cwd=ROOT, capture_output=True, text=True, timeout=600, check=False
    )
    assert finished.returncode == 0, finished.stderr
    return finished.stdout


@pytest.mark.parametrize("arch", ["amd64", "arm64"])
def test_the_same_commit_gives_the_same_package(arch):
    digests = {
        hashlib.sha256((ROOT / made("deb", f"ARCH={arch}").split()[-1]).read_bytes()).hexdigest() for _ in range(2)
    }
    assert len(digests) == 1


def test_the_packages_wheels_make_an_environment_without_a_network(tmp_path):
    deb = ROOT / made("deb", f"PYTHON_VERSION={sys.version_info.major}.{sys.version_info.minor}").split()[-1]
    subprocess.run(["dpkg-deb", "-x", deb, tmp_path / "root"], check=True)
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "venv"], check=True)
    wheels = (tmp_path / "root/usr/share/dob-companion/wheels").glob("*.whl")
    pip = [tmp_path / "venv/bin/python", "-m", "pip", "install", "--quiet", "--no-index", "--no-deps"]
    subprocess.run([*pip, *wheels], check=True)
    said = subprocess.run([tmp_path / "venv/bin/dob-companion", "run", "--help"], capture_output=True, check=True)
    assert b"--design" in said.stdout


def test_everything_that_flies_has_wheels_for_64_bit_arm():
    said = made("wheels-aarch64")
    assert said.count("numpy-") == said.count("pymavlink-") == said.count("pyserial-") == 3
