"""How many examples of a property are tried: all of them by `make proof`, two in five by `make test` (conftest.py)."""

from hypothesis import settings


def examples(all_of_them: int) -> int:
    return all_of_them * settings.default.max_examples // 100
