"""A link around another: whatever is not changed is the inner one's."""

from collections.abc import Callable

from dob_companion.companion import Event
from dob_companion.runtime.links import Link


class AroundLink:
    """A `Link` that hands everything on to the one inside."""

    def __init__(self, link: Link) -> None:
        self._link = link

    def fileno(self) -> int:
        """See `Link`."""
        return self._link.fileno()

    def read(self) -> bytes | None:
        """See `Link`."""
        return self._link.read()

    def write(self, *messages: bytes) -> None:
        """See `Link`."""
        self._link.write(*messages)

    def flush(self) -> bool:
        """See `Link`."""
        return self._link.flush()

    def seal_with(self, seal: Callable[[bytes], bytes]) -> None:
        """See `Link`; what was there is replaced, signatures included."""
        self._link.seal_with(seal)

    def events(self) -> list[Event]:
        """See `Link`."""
        return self._link.events()

    def close(self) -> None:
        """See `Link`."""
        self._link.close()
