"""Link URLs: `udpin:HOST:PORT`, `udpout:HOST:PORT`, `tcp:HOST:PORT`, `serial:DEVICE:BAUD`, and what other programs call
these: MAVProxy's `/dev/ttyACM0,57600`, `udp:HOST:PORT` and `HOST:PORT`, MAVSDK's `udpin://…`, `tcpout://…`,
`serial:///dev/…`."""

import re
from dataclasses import dataclass

from dob_companion.errors import LinkUrlError

_SAME = {"udp": "udpin", "tcpout": "tcp"}
_NETWORK = ("udpin", "udpout", "tcp")
FORMS = "udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT or serial:DEVICE:BAUD"
_LOOPBACK = "127.0.0.1"
_TCP_PORT = 5760
_FASTEST_BAUD = 4_000_000
_BARE_DEVICE = r"(tty|serial\d)"
_BARE_ADDRESS = r"\d+|:\d+|([\d.]+|localhost|\[[^\]]+\]):\d+"
_INSTEAD = {
    "tcpin": "listening for TCP is not supported; tcp:HOST:PORT connects",
    "udpbcast": "broadcast is not supported; udpout:HOST:PORT sends to one host",
    "mcast": "multicast is not supported; udpin:HOST:PORT listens",
}


@dataclass(frozen=True, slots=True)
class LinkUrl:
    """Where a link goes: a host and its port, or a serial device and its baud rate."""

    scheme: str
    target: str
    number: int

    @property
    def datagrams(self) -> bool:
        """Whether messages arrive in whole datagrams."""
        return self.scheme in ("udpin", "udpout")

    @property
    def host(self) -> str:
        """The target as a URL writes it: an IPv6 address in brackets."""
        return f"[{self.target}]" if self.scheme in _NETWORK and ":" in self.target else self.target

    def __str__(self) -> str:
        return f"{self.scheme}:{self.host}:{self.number}"


def parse_link_url(url: str, *, udp_port: int = 14540, baud: int = 921600) -> LinkUrl:
    """Read a link URL; `udp_port` and `baud` are taken where it names none, and loopback where it names no host.

    Raises LinkUrlError, one line, that says what was expected.
    """
    scheme, rest = _scheme(url)
    if scheme in _INSTEAD:
        raise LinkUrlError(f"link {url!r}: {_INSTEAD[scheme]}")
    if scheme not in (*_NETWORK, "serial") or not rest.strip(":,/"):
        raise LinkUrlError(f"link {url!r}: expected {FORMS}")
    if scheme == "serial":
        return _serial(url, rest, baud)
    return _network(url, scheme, rest.removesuffix("/"), _TCP_PORT if scheme == "tcp" else udp_port)


def _scheme(url: str) -> tuple[str, str]:
    """What kind of link it is, and the rest. "" where neither word nor form says."""
    if url.startswith("/"):
        return "serial", url
    if re.match(_BARE_DEVICE, url):
        return "serial", f"/dev/{url}"
    if re.fullmatch(_BARE_ADDRESS, url):
        return "udpin", url
    word, colon, rest = url.partition(":")
    word = word.lower()
    return (_SAME.get(word, word), rest.removeprefix("//")) if colon else ("", url)


def _network(url: str, scheme: str, rest: str, default: int) -> LinkUrl:
    if rest.isascii() and rest.isdigit():
        host, number = "", rest
    elif ":" in rest and not rest.endswith("]"):
        host, _, number = rest.rpartition(":")
    else:
        host, number = rest, str(default)
    port = _number(number, 65535)
    if port is None:
        raise LinkUrlError(f"link {url!r}: {number!r} is not a port from 1 to 65535")
    if "@" in host or host.count(":") == 1:
        raise LinkUrlError(f"link {url!r}: {host!r} is not one host; expected {FORMS}")
    return LinkUrl(scheme, host.removeprefix("[").removesuffix("]") or _LOOPBACK, port)


def _serial(url: str, rest: str, default: int) -> LinkUrl:
    device, comma, number = rest.partition(",")
    if not comma:
        device, _, number = rest.rpartition(":") if ":" in rest and not _by_path(rest) else (rest, "", str(default))
    baud = _number(number, _FASTEST_BAUD)
    if baud is None:
        raise LinkUrlError(f"link {url!r}: {number!r} is not a baud rate")
    return LinkUrl("serial", f"/dev/{device}" if re.match(_BARE_DEVICE, device) else device, baud)


def _by_path(device: str) -> bool:
    """Names in /dev/serial/by-path hold colons, and end in `:1.0` or `:1.0-port0`."""
    return re.search(r":\d+\.\d+(-port\d+)?$", device) is not None


def _number(text: str, largest: int) -> int | None:
    return int(text) if text.isascii() and text.isdigit() and 1 <= int(text) <= largest else None
