"""Sockets: link URLs, UDP and TCP links, and waiting for several of them at once."""

import re
import select
import socket
from typing import Protocol

from sitl.errors import LinkBusyError, LinkUrlError

_URL = re.compile(r"(?P<scheme>udpin|udpout|tcp):(?://)?(?P<host>\[[^\]]+\]|[^:/\[\]]+):(?P<port>\d{1,5})$")
RECEIVE = 65536


def parse_url(url: str) -> tuple[str, str, int]:
    """Scheme, host and port of `udpin:HOST:PORT`, `udpout:…`, `tcp:…` or their `scheme://` spelling.

    Raises LinkUrlError.
    """
    match = _URL.match(url)
    port = int(match["port"]) if match else 0
    if match is None or not 0 < port < 65536:
        raise LinkUrlError(f"link {url!r}: expected udpin:HOST:PORT, udpout:HOST:PORT or tcp:HOST:PORT")
    return match["scheme"], match["host"].strip("[]"), port


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
        while True:
            try:
                data, source = self._socket.recvfrom(RECEIVE)
            except OSError:
                return out
            if not self._fixed:
                self._peer = source
            if source == self._peer:
                out.append(data)

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

    def sockets(self) -> list[socket.socket]:
        """See `Link`."""
        return [self._listener, self._client] if self._client else [self._listener]

    def receive(self) -> list[bytes]:
        """See `Link`."""
        self._accept()
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
        """See `Link`; a client that does not keep up is dropped, for half a message would garble the stream."""
        if self._client is None:
            return
        try:
            whole = self._client.send(datagram) == len(datagram)
        except OSError:
            whole = False
        if not whole:
            self._drop()

    def _drop(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None

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
    except OSError as error:
        raise LinkUrlError(f"link {url!r}: host {host!r} cannot be resolved: {error}") from None


def _bind(sock: socket.socket, url: str, address: tuple[object, ...]) -> None:
    try:
        sock.bind(address)
    except OSError as error:
        sock.close()
        raise LinkBusyError(f"link {url!r}: the port cannot be opened: {error.strerror}") from None
