"""Sockets: link URLs, UDP and TCP links, and waiting for several of them at once."""

import re
import select
import socket
from collections import deque
from typing import Protocol

from sitl.errors import LinkBusyError, LinkUrlError

_URL = re.compile(
    r"(?P<scheme>udpin|udpout|udp|tcpin|tcp):(?://)?(?:(?P<host>\[[^\]]+\]|[^:/\[\]]+)?:)?(?P<port>\d{1,5})$"
)
_SAME = {"udp": "udpin", "tcpin": "tcp"}
"""As MAVProxy and MAVSDK call them; our `tcp` listens."""
_OTHER = {"udpin": "udpout", "udpout": "udpin", "tcp": "tcp"}
RECEIVE = 65536
MOST_DATAGRAMS = 256
"""Datagrams taken at once: a flood must not fill the memory, nor keep the vehicle from flying."""

MOST_DATAGRAMS = 256
"""Taken at once: whoever floods a link must not stop the clock."""

WAITING = 1 << 16
"""Bytes kept for a client that does not keep up."""


def parse_url(url: str) -> tuple[str, str, int]:
    """Scheme, host and port of `udpin:HOST:PORT`, `udpout:…`, `tcp:…` or their `scheme://` spelling; without a host
    it is loopback. Raises LinkUrlError.
    """
    match = _URL.match(url)
    port = int(match["port"]) if match else 0
    if match is None or not 0 < port < 65536:
        raise LinkUrlError(f"link {url!r}: expected udpin:HOST:PORT, udpout:HOST:PORT or tcp:HOST:PORT")
    return _SAME.get(match["scheme"], match["scheme"]), (match["host"] or "127.0.0.1").strip("[]"), port


def other_end(url: str) -> str:
    """The URL by which a companion or a ground station meets the link that `url` names."""
    scheme, host, port = parse_url(url)
    host = f"[{host}]" if ":" in host else host
    return f"{_OTHER[scheme]}:{host}:{port}"


class Link(Protocol):
    """A byte link that never blocks and loses what nobody takes, like a wire."""

    def sockets(self) -> list[socket.socket]:
        """What to wait for until `receive` has something."""
        ...

    def receive(self) -> list[bytes]:
        """Everything that has arrived."""
        ...

    def send(self, datagram: bytes) -> None:
        """Send, or drop when nobody is there."""
        ...

    def close(self) -> None:
        """Release the port."""
        ...


class UdpLink:
    """`udpout` sends to a fixed peer and hears only it; `udpin` waits and answers whoever spoke last."""

    def __init__(self, url: str, bind: bool, host: str, port: int) -> None:
        family, _, _, _, address = _resolve(url, host, port, socket.SOCK_DGRAM)
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._peer = None if bind else address
        self._fixed = not bind
        self._socket.setblocking(False)
        if bind:
            _bind(self._socket, url, address)

    def sockets(self) -> list[socket.socket]:
        """See `Link`."""
        return [self._socket]

    def receive(self) -> list[bytes]:
        """See `Link`."""
        out: list[bytes] = []
        for _ in range(MOST_DATAGRAMS):
            try:
                data, source = self._socket.recvfrom(RECEIVE)
            except OSError:
                break
            if not self._fixed:
                self._peer = source
            if source == self._peer:
                out.append(data)
        return out

    def send(self, datagram: bytes) -> None:
        """See `Link`."""
        if self._peer is not None:
            try:
                self._socket.sendto(datagram, self._peer)
            except OSError:
                return  # no room or no route: a datagram lost

    def close(self) -> None:
        """See `Link`."""
        self._socket.close()


class TcpLink:
    """A listening port with one client at a time; a new one replaces the old."""

    def __init__(self, url: str, host: str, port: int) -> None:
        family, _, _, _, address = _resolve(url, host, port, socket.SOCK_STREAM)
        self._listener = socket.socket(family, socket.SOCK_STREAM)
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        _bind(self._listener, url, address)
        self._listener.listen(1)
        self._listener.setblocking(False)
        self._client: socket.socket | None = None
        self._waiting: deque[bytes] = deque()
        self._begun = False

    def sockets(self) -> list[socket.socket]:
        """See `Link`."""
        return [self._listener, self._client] if self._client else [self._listener]

    def receive(self) -> list[bytes]:
        """See `Link`."""
        self._accept()
        self._pass_on()
        if self._client is None:
            return []
        try:
            data = self._client.recv(RECEIVE)
        except BlockingIOError:
            return []
        except OSError:
            data = b""
        if not data:
            self._drop()
            return []
        return [data]

    def _accept(self) -> None:
        try:
            client, _ = self._listener.accept()
        except OSError:
            return
        self._drop()
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._client = client

    def send(self, datagram: bytes) -> None:
        """See `Link`; for a client that does not keep up the oldest datagrams are lost, each whole, since a part of one
        would garble the stream."""
        if self._client is not None:
            self._waiting.append(datagram)
            while len(self._waiting) > 1 + self._begun and sum(map(len, self._waiting)) > WAITING:
                del self._waiting[int(self._begun)]
            self._pass_on()

    def _pass_on(self) -> None:
        try:
            while self._waiting and self._client is not None:
                data = self._waiting[0]
                sent = self._client.send(data)
                self._begun = sent < len(data)
                if self._begun:
                    self._waiting[0] = data[sent:]
                else:
                    self._waiting.popleft()
        except BlockingIOError:
            return
        except OSError:
            self._drop()

    def _drop(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None
        self._waiting.clear()
        self._begun = False

    def close(self) -> None:
        """See `Link`."""
        self._drop()
        self._listener.close()


def open_link(url: str) -> Link:
    """Open the link that `url` names. Raises LinkUrlError and LinkBusyError."""
    scheme, host, port = parse_url(url)
    if scheme == "tcp":
        return TcpLink(url, host, port)
    return UdpLink(url, scheme == "udpin", host, port)


def wait(links: dict[str, Link], timeout: float) -> list[tuple[str, bytes]]:
    """Wait up to `timeout` seconds for bytes on any link; what came, with the link's name."""
    waiting = {s: name for name, link in links.items() for s in link.sockets()}
    ready, _, _ = select.select(list(waiting), (), (), max(0.0, timeout))
    names = dict.fromkeys(waiting[s] for s in ready)
    return [(name, data) for name in names for data in links[name].receive()]


def _resolve(url: str, host: str, port: int, kind: socket.SocketKind):  # type: ignore[no-untyped-def]
    try:
        return socket.getaddrinfo(host, port, type=kind)[0]
    except (OSError, UnicodeError) as error:  # UnicodeError: a label of a name that is empty or too long
        raise LinkUrlError(f"link {url!r}: host {host!r} cannot be resolved: {error}") from None


def _bind(sock: socket.socket, url: str, address: tuple[object, ...]) -> None:
    try:
        sock.bind(address)
    except OSError as error:
        sock.close()
        raise LinkBusyError(f"link {url!r}: the port cannot be opened: {error.strerror}") from None
