import pytest

from dob_companion.artifact import dumps
from tests.companion.aircraft import small_design


@pytest.fixture(scope="session")
def design(tmp_path_factory):
    path = tmp_path_factory.mktemp("design") / "design.json"
    path.write_text(dumps(small_design())[0])
    return path
