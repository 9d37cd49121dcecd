import pytest

from dob_companion.artifact import dumps
from tests.companion.aircraft import small_design


@pytest.fixture
def design(tmp_path):
    path = tmp_path / "design.json"
    path.write_text(dumps(small_design())[0])
    return path
