"""Links with MAVLink 2 signing: what goes out is signed, and only what is rightly signed comes in."""

import time

from dob_companion.mavlink.signing import SigningGate, ticks
from dob_companion.runtime.around import AroundLink
from dob_companion.runtime.links import Link

MOST_REFUSED = 256
"""Pieces refused in a row before the loop gets its turn: a flood must not keep it from its deadlines."""


class SigningLink(AroundLink):
    """A `Link` around another that signs what goes out and lets everything in, for who judges it by himself.

    The computer's clock gives the timestamps as long as it runs forwards; the gate keeps them increasing when it does
    not. A message is signed when it leaves, not when it is written: a receiver refuses timestamps that go back.
    """

    def __init__(self, link: Link, gate: SigningGate) -> None:
        super().__init__(link)
        self._gate = gate
        link.seal_with(lambda message: gate.sign(message, ticks(time.time())))


class SignedLink(SigningLink):
    """Lets in only what the gate admits."""

    def read(self) -> bytes | None:
        """The next piece that holds something admitted; None when there is nothing more, or enough was refused."""
        for _ in range(MOST_REFUSED):
            data = self._link.read()
            if data is None:
                return None
            admitted = self._gate.admit(data)
            if admitted:
                return admitted
        return None
