"""A link of which somebody else sees all that passes."""

from collections.abc import Callable

from dob_companion.companion import Event
from dob_companion.runtime.links import Link


class TappedLink:
    """A `Link` around another; `heard` and `said` are called with each piece as it passes, and must return at once."""

    def __init__(self, link: Link, heard: Callable[[bytes], None], said: Callable[[bytes], None]) -> None:
        self._link = link
        self._heard, self._said = heard, said

    def fileno(self) -> int:
        """See `Link`."""
        return self._link.fileno()

    def read(self) -> bytes | None:
        """See `Link`."""
        data = self._link.read()
        if data is not None:
            self._heard(data)
        return data

    def write(self, *messages: bytes) -> None:
        """See `Link`."""
        for message in messages:
            self._said(message)
        self._link.write(*messages)

    def flush(self) -> bool:
        """See `Link`."""
        return self._link.flush()

    def seal_with(self, seal: Callable[[bytes], bytes]) -> None:
        """See `Link`."""
        self._link.seal_with(seal)

    def events(self) -> list[Event]:
        """See `Link`."""
        return self._link.events()

    def close(self) -> None:
        """See `Link`."""
        self._link.close()
