"""constraints.txt pins everything that pyproject.toml asks for."""

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.packaging.project import EXTRAS, PROJECT, ROOT, requirements

LINES = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
PINS = {canonicalize_name(pin.name): pin for pin in (Requirement(line) for line in LINES if not line.startswith("#"))}


def test_every_pin_is_one_exact_version():
    assert [str(pin) for pin in PINS.values() if [s.operator for s in pin.specifier] != ["=="]] == []


@pytest.mark.parametrize("name", sorted(requirements(PROJECT["dependencies"], *EXTRAS.values())))
def test_a_requirement_is_pinned_within_its_bounds(name):
    assert name in PINS, "run `make pins`"
    (pinned,) = PINS[name].specifier
    assert requirements(PROJECT["dependencies"], *EXTRAS.values())[name].specifier.contains(pinned.version)
