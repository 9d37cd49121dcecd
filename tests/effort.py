"""How much is tried: all of it by `make proof`, a part by `make test` (conftest.py)."""

from collections.abc import Iterable
from typing import Any

import pytest
from hypothesis import settings


def examples(all_of_them: int) -> int:
    """Of a property: two in five."""
    return all_of_them * settings.default.max_examples // 100


def a_few(cases: Iterable[Any], *, every: int) -> list[Any]:
    """Cases of one behaviour: the first and each so many after it; the others by `make proof`."""
    return [case if k % every == 0 else pytest.param(case, marks=pytest.mark.proof) for k, case in enumerate(cases)]
