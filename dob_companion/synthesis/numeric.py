"""The one place where an error of a numeric library becomes one of ours.

What users give may be any numbers. Where a library gives up on them (a singular matrix, an overflow, eigenvalues on the
unit circle) the problem as posed has no answer in double precision: a refusal, no fault of the program. The library's
own words stand in the message, and its error is the cause.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType

import numpy as np

from dob_companion.errors import DobError, UnsolvableError

TROUBLE = (np.linalg.LinAlgError, ArithmeticError, ValueError, MemoryError)
"""What numpy, scipy, python-control and cvxpy raise over numbers; a ValueError only from code of theirs."""


@contextmanager
def numbers_judged(what: str = "") -> Iterator[None]:
    """Let numbers overflow in silence, and turn what libraries raise over them into an UnsolvableError of one line."""
    try:
        with np.errstate(all="ignore"):
            yield
    except DobError:
        raise
    except TROUBLE as trouble:
        if type(trouble) is ValueError and _is_ours(trouble.__traceback__):
            raise
        words = " ".join(str(trouble).split()) or type(trouble).__name__
        place = f"{what}: " if what else ""
        raise UnsolvableError(
            f"{place}no answer in double precision ({words.rstrip('.')}): expected plant, controller and weights "
            "whose gains and time constants lie within some ten powers of ten"
        ) from trouble


def _is_ours(trace: TracebackType | None) -> bool:
    """Whether an error was raised in a line of this package."""
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return trace is not None and str(trace.tb_frame.f_globals.get("__name__", "")).startswith("dob_companion.")
