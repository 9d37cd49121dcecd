"""Sockets, serial lines, the clock and signals: the rim around the pure companion."""

from dob_companion.runtime.daemon import serve
from dob_companion.runtime.links import Link, open_link
from dob_companion.runtime.systemd import Notifier
from dob_companion.runtime.urls import LinkUrl, parse_link_url

__all__ = ["Link", "LinkUrl", "Notifier", "open_link", "parse_link_url", "serve"]
