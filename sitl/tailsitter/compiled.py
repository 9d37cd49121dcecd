"""`compiled`: numba's njit where it is installed, nothing where it is not. Compiled code is cached on disk."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])

try:
    from numba import njit
except ImportError:

    def compiled(function: F) -> F:
        """Without numba: the function itself."""
        return function

else:

    def compiled(function: F) -> F:
        """`function`, compiled at its first call; IEEE arithmetic in the order written, as in Python."""
        return cast(F, njit(cache=True, fastmath=False, error_model="numpy")(function))
