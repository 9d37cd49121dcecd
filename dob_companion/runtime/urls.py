"""Link URLs: `udpin:HOST:PORT`, `udpout:HOST:PORT`, `tcp:HOST:PORT`, `serial:DEVICE:BAUD`, `scheme://` as well."""

from dataclasses import dataclass

from dob_companion.errors import LinkUrlError

NETWORK_SCHEMES = ("udpin", "udpout", "tcp")
_FORMS = "udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT or serial:DEVICE:BAUD"


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

    def __str__(self) -> str:
        return f"{self.scheme}:{self.target}:{self.number}"


def parse_link_url(url: str) -> LinkUrl:
    """Read a link URL. Raises LinkUrlError, one line, that says what was expected."""
    scheme, colon, rest = url.partition(":")
    rest = rest.removeprefix("//")
    target, last_colon, number = rest.rpartition(":")
    if not (colon and last_colon and target) or scheme not in (*NETWORK_SCHEMES, "serial"):
        raise LinkUrlError(f"link {url!r}: expected {_FORMS}")
    limit = 65535 if scheme in NETWORK_SCHEMES else 4_000_000
    if not (number.isascii() and number.isdigit() and 1 <= int(number) <= limit):
        what = "a port from 1 to 65535" if scheme in NETWORK_SCHEMES else "a baud rate"
        raise LinkUrlError(f"link {url!r}: {number!r} is not {what}")
    return LinkUrl(scheme, target.removeprefix("[").removesuffix("]"), int(number))
