"""A link of which somebody else sees all that passes."""

from collections.abc import Callable

from dob_companion.runtime.around import AroundLink
from dob_companion.runtime.links import Link


class TappedLink(AroundLink):
    """A `Link` around another; `heard` and `said` are called with each piece as it passes, and must return at once."""

    def __init__(self, link: Link, heard: Callable[[bytes], None], said: Callable[[bytes], None]) -> None:
        super().__init__(link)
        self._heard, self._said = heard, said

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
