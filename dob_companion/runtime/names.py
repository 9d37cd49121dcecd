"""Host names, looked up once, before the loop begins: a name server that does not answer would hold it for seconds."""

import socket
from typing import Any

from dob_companion.errors import LinkBusyError
from dob_companion.runtime.urls import FORMS, LinkUrl


def addresses(url: LinkUrl, kind: socket.SocketKind) -> list[tuple[socket.AddressFamily, Any]]:
    """All addresses of a network link, in the system's order of preference.

    Raises LinkBusyError, one line, for a name that nobody knows or that is none.
    """
    try:
        found = socket.getaddrinfo(url.target, url.number, type=kind)
    except OSError as problem:
        reason = problem.strerror
    except ValueError:  # a label that is empty or too long, a character that no name may hold
        reason = "it is no host name"
    else:
        return [(family, address) for family, _, _, _, address in found]
    raise LinkBusyError(
        f"link {url}: cannot be opened: host {url.target!r} cannot be resolved: {reason}; expected {FORMS}"
    )
