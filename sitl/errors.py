"""What ends a simulation on purpose, and the exit code it ends with.

::

    SitlError
    ├── InputError (ValueError)         it could not begin           exit 2
    │   ├── ScenarioError               a scenario file or name
    │   ├── LinkUrlError                a --link or --gcs URL
    │   └── LinkBusyError (OSError)     a port that cannot be opened
    └── FlightFailedError (RuntimeError)  it began and did not end well   exit 1

Each message is one line that names the file, key or event and says what was expected.
"""


class SitlError(Exception):
    """Base of all errors raised on purpose; `exit_code` is what the command line returns."""

    exit_code = 1


class InputError(SitlError, ValueError):
    """The input is unusable, so nothing was begun."""

    exit_code = 2


class ScenarioError(InputError):
    """A scenario is unknown, malformed or holds an unknown key."""


class LinkUrlError(InputError):
    """A link URL does not follow `udpin:HOST:PORT`, `udpout:HOST:PORT` or `tcp:HOST:PORT`."""


class LinkBusyError(InputError, OSError):
    """A port cannot be opened."""


class FlightFailedError(SitlError, RuntimeError):
    """The flight did not reach its end."""
