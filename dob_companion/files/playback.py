"""A recorded flight read back: the calls that the loop made, in order, to whoever listens."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Protocol

from dob_companion.errors import InputError
from dob_companion.files.segments import chunks
from dob_companion.files.trace import EARLIER, SCHEMA, Ending, Item, Kind, read_frames

FIRST_PROFILE = "sitl"


@dataclass(frozen=True, slots=True, kw_only=True)
class Header:
    """What a segment says of itself.

    started      RFC 3339 time, unix_offset the unix time in s at zero of the daemon's monotonic clock: as its
                 computer's clock had it
    datagrams    whether the link delivered whole datagrams
    config       the configuration's text, design that of the design.json
    profile      the one that was asked for; recordings from before there was a choice do not say it
    """

    generator: str
    machine: str
    started: str
    unix_offset: float
    flight: int
    datagrams: bool
    config: str
    design: str
    profile: str = FIRST_PROFILE


class Listener(Protocol):
    """Who is told of a recorded flight. Times are seconds of the daemon's monotonic clock."""

    def began(self, header: Header) -> None:
        """A segment begins."""

    def checkpoint(self, state: Mapping[str, Any]) -> None:
        """The companion's state at this moment."""

    def standing(self, content: Mapping[str, Any]) -> None:
        """Of the checkpoint before, what readers may rely on: see `flightlog.standing`."""

    def changed(self, content: Mapping[str, Any]) -> None:
        """The supervisor's `state` is another now, for this `reason`."""

    def lost(self, turns: int) -> None:
        """Something is missing here: so many turns, or 0 where nobody knows. A checkpoint comes next."""

    def received(self, data: bytes, now: float) -> None:
        """Bytes came from the link."""

    def advanced(self, now: float) -> None:
        """Time has passed."""

    def closing(self, now: float) -> None:
        """The companion was told to leave."""

    def loaded(self, load: tuple[int, int, int]) -> None:
        """It was told uptime in ms, memory in use and in all in MiB."""

    def said(self, message: bytes) -> None:
        """It answered to the call before."""

    def turned(self, now: float, took_s: float) -> None:
        """A turn of the loop is over."""


def play(path: Path, listener: Listener) -> Ending:
    """Tell `listener` one segment. Raises InputError, one line, when the file is not one."""
    return play_chunks(chunks(path), listener, str(path))


def play_chunks(pieces: Iterable[bytes], listener: Listener, source: str) -> Ending:
    """Tell `listener` the segment whose bytes come in `pieces`; `source` names it in errors."""
    ending = Ending()
    begun, now = False, 0.0
    for turn in read_frames(pieces, ending):
        if not begun:
            listener.began(_header(turn, source))
            begun = True
            continue
        for item in turn:
            if item.kind is Kind.TIME:
                now = item.seconds
            else:
                _tell(item, now, listener, source)
    if not begun:
        raise InputError(f"{source}: not a recorded flight: {ending.damage or 'it holds not one whole record'}")
    if ending.torn or ending.damage:
        listener.lost(0)
    return ending


def _tell(item: Item, now: float, listener: Listener, source: str) -> None:
    match item.kind:
        case Kind.RECEIVED:
            listener.received(item.data, now)
        case Kind.ADVANCED:
            listener.advanced(now)
        case Kind.SAID:
            listener.said(item.data)
        case Kind.TOOK:
            listener.turned(now, item.seconds)
        case Kind.CLOSING:
            listener.closing(now)
        case Kind.LOST:
            listener.lost(item.count)
        case Kind.LOAD:
            uptime, used, total = _read(item, list, source)
            listener.loaded((uptime, used, total))
        case Kind.CHECKPOINT:
            listener.checkpoint(_read(item, dict, source))
        case Kind.STANDING:
            listener.standing(_read(item, dict, source))
        case Kind.CHANGED:
            listener.changed(_read(item, dict, source))


def _header(turn: list[Item], source: str) -> Header:
    if [item.kind for item in turn] != [Kind.HEADER]:
        raise InputError(f"{source}: not a recorded flight: it does not begin with a header")
    content = {"profile": FIRST_PROFILE, **_read(turn[0], dict, source)}
    if content.get("schema") not in (SCHEMA, *EARLIER):
        raise InputError(f"{source}: schema is {content.get('schema')!r}, expected {SCHEMA!r}")
    for field in fields(Header):
        if type(content.get(field.name)) is not field.type:
            kind = getattr(field.type, "__name__", field.type)
            raise InputError(f"{source}: header.{field.name} is {content.get(field.name)!r}, expected {kind}")
    return Header(**{field.name: content[field.name] for field in fields(Header)})


def _read(item: Item, kind: type, source: str) -> Any:
    try:
        value = json.loads(item.data)
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, kind):
        raise InputError(f"{source}: a {item.kind.name.lower()} is not JSON of the kind expected")
    return value
