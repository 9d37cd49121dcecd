"""Every error this program raises on purpose, and the exit code it ends with.

::

    DobError
    ├── InputError (ValueError)              it could not begin            exit 2
    │   ├── SpecError                        a design spec
    │   ├── DesignFileError                  a design.json
    │   ├── ConfigError                      a daemon configuration
    │   ├── LogError                         a log or table of flight data
    │   ├── LinkUrlError                     a --link URL
    │   └── LinkBusyError (OSError)          a port or device that cannot be opened
    └── RefusedError                         it began; the answer is no    exit 1
        ├── UnsolvableError (ArithmeticError)  no observer exists for this problem
        ├── NotCertifiedError (ArithmeticError)  one was found but its proof failed
        ├── NotConvergedError (ArithmeticError)  a search did not reach its accuracy
        ├── NoVehicleError (TimeoutError)    nobody answered in time
        └── FlightFailedError (RuntimeError) a flight did not reach its end

Each message is one line that names the file, key or field and says what was expected.
"""

import difflib
from collections.abc import Iterable
from typing import TypeVar


class DobError(Exception):
    """Base of all errors raised on purpose; `exit_code` is what the command line returns."""

    exit_code = 1


class InputError(DobError, ValueError):
    """The input is unusable, so nothing was begun."""

    exit_code = 2


class SpecError(InputError):
    """A design spec is malformed, mis-shaped or holds an unknown key."""


class DesignFileError(InputError):
    """A design.json is malformed, altered, or not fit to fly."""


class ConfigError(InputError):
    """A daemon configuration is malformed or holds an unknown key."""


class LogError(InputError):
    """A log or table of flight data is of no known kind, damaged beyond use, or lacks what is needed of it."""


class LinkUrlError(InputError):
    """A link URL does not follow `scheme:host:port` or `serial:device:baud`."""


class LinkBusyError(InputError, OSError):
    """A port or device cannot be opened."""


class RefusedError(DobError):
    """The work began and its answer is no."""


class UnsolvableError(RefusedError, ArithmeticError):
    """No observer can solve the problem as posed; the message names the axis and the physics."""


class NotCertifiedError(RefusedError, ArithmeticError):
    """An observer was computed but did not pass its own certificate."""


class NotConvergedError(RefusedError, ArithmeticError):
    """A search or iteration ended short of its accuracy: there is no number rather than a wrong one."""


class NoVehicleError(RefusedError, TimeoutError):
    """No vehicle answered within the time given."""


class FlightFailedError(RefusedError, RuntimeError):
    """A demo or scenario flight ended before it was complete."""


_E = TypeVar("_E", bound=DobError)


def placed(problem: _E, place: str) -> _E:
    """The same error, whose message begins with `place`: a file, a block."""
    words = str(problem)
    return problem if words.startswith(place) else type(problem)(f"{place}: {words}")


def unknown_key(key: str, known: Iterable[str]) -> str:
    """What to say of a key that is not among the known ones: the nearest of them, or all when none is near."""
    known = tuple(known)
    near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    hint = f"did you mean {near[0]!r}?" if near else f"known keys: {', '.join(known)}"
    return f"unknown key {key!r}; {hint}"
