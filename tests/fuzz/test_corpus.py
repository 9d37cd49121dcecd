"""What fuzzing has found once stays found: each kept input again, without the fuzzer."""

import pytest

from tests.fuzz.__main__ import CORPUS
from tests.fuzz.targets import TARGETS, seeds


@pytest.mark.parametrize("name", TARGETS)
def test_the_kept_inputs_are_read_or_refused_in_one_line(name):
    kept = sorted((CORPUS / name).iterdir())
    assert kept, "no corpus"
    for data in [*seeds(name), *(path.read_bytes() for path in kept)]:
        TARGETS[name](data)
