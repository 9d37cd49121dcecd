"""The paper's pitch axis, designed and compared once for all tests of this room."""

import pytest

from dob_companion.comparison import compare
from dob_companion.comparison.vehicle import Vehicle
from dob_companion.synthesis import design_from_toml
from tests.synthesis import paper

SEEDS = 3


def pitch_text(delay=1):
    """The paper's spec with nothing but its pitch axis."""
    text = paper.spec_text(delay)
    return text[: text.index("# Roll and yaw:")]


@pytest.fixture(scope="session")
def designs():
    """tau -> design of the pitch axis."""
    return {tau: design_from_toml(pitch_text(tau)) for tau in (0, 1)}


@pytest.fixture(scope="session")
def pitch(designs):
    """The comparison at tau = 1."""
    return compare(designs[1], SEEDS, "spec.toml")[0]


@pytest.fixture
def vehicle():
    return Vehicle(paper.PLANT, paper.PID, 1)
