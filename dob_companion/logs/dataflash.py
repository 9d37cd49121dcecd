"""ArduPilot's logs, binary (.bin) and as text (.log): the messages of a kind as columns.

Binary: `A3 95 type`, then the fields that a FMT message of this type declares
(https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html). Messages are found at once, in the whole
file: every place where one may begin, and of these the ones that follow one another.
"""

import re
from collections.abc import Iterator
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from dob_companion.errors import LogError
from dob_companion.identification.record import Floats
from dob_companion.logs.columns import Table

HEAD = b"\xa3\x95"
_FMT, _FMT_SIZE = 128, 89

_FIRST = HEAD + bytes((_FMT, _FMT, _FMT_SIZE)) + b"FMT\0"
"""The FMT that declares FMT: with it a log begins."""

_BEGINNING = 1 << 15
"""Bytes in which a log declares its messages; it may do so twice."""

_TYPES = {
    "a": "(32,)<i2", "b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4", "f": "<f4", "d": "<f8",
    "n": "S4", "N": "S16", "Z": "S64", "c": "<i2", "C": "<u2", "e": "<i4", "E": "<u4", "L": "<i4", "M": "u1",
    "q": "<i8", "Q": "<u8", "g": "<f2",
}  # fmt: skip
_SCALES = {"c": 0.01, "C": 0.01, "e": 0.01, "E": 0.01, "L": 1e-7}
_WORD = re.compile(r"[A-Za-z0-9_]+")


def pieces(data: bytes) -> Iterator[bytes]:
    """The logs in a file, one after the other."""
    begins = [0]
    for match in re.finditer(re.escape(_FIRST), data):
        if match.start() - begins[-1] > _BEGINNING:
            begins.append(match.start())
    for begin, end in zip(begins, [*begins[1:], len(data)], strict=True):
        yield data[begin:end]


class DataFlash(Protocol):
    """A log of ArduPilot's, whole."""

    remarks: list[str]

    def table(self, name: str) -> Table | None:
        """The messages of this name; None where there is none."""


class Format(NamedTuple):
    """A kind of message, as its FMT declares it."""

    name: str
    size: int
    kinds: str
    columns: tuple[str, ...]

    @property
    def layout(self) -> np.dtype[np.void]:
        """The fields after the head, packed."""
        return np.dtype([(column, _TYPES[kind]) for column, kind in zip(self.columns, self.kinds, strict=True)])


def looks_binary(begin: bytes) -> bool:
    """Whether these first bytes may be a binary log's: a message, or somewhere the FMT that declares FMT."""
    return begin.startswith(HEAD) or _FIRST in begin


def looks_text(begin: bytes) -> bool:
    """Whether these first bytes may be a log's as text: a line that declares FMT."""
    return re.search(rb"(?m)^\s*FMT, *128, *89, *FMT\b", begin) is not None


class BinaryLog:
    """A .bin. Raises LogError, without the file's name, when it declares no messages."""

    def __init__(self, data: bytes) -> None:
        self.remarks: list[str] = []
        self._bytes = np.frombuffer(data, np.uint8)
        begins = self._begins()
        self._formats = self._declared(data, begins[self._bytes[begins + 2] == _FMT])
        if not self._formats:
            raise LogError("no FMT messages in it, expected those that declare what is logged")
        self._messages = self._chain(begins)
        self._kinds = self._bytes[self._messages + 2]
        self._units: dict[int, dict[str, str]] = {}
        self._units = self._declared_units()

    def table(self, name: str) -> Table | None:
        """See DataFlash."""
        number = next((number for number, declared in self._formats.items() if declared.name == name), None)
        if number is None:
            return None
        place = self._messages[self._kinds == number]
        if not len(place):
            return None
        declared = self._formats[number]
        windows = np.lib.stride_tricks.sliding_window_view(self._bytes, declared.size)
        rows = windows[place][:, 3:].copy().view(declared.layout)[:, 0]
        kinds = dict(zip(declared.columns, declared.kinds, strict=True))

        def numbers(column: str) -> Floats:
            values = rows[column]
            if values.dtype.kind not in "iuf" or values.ndim != 1:
                raise KeyError(column)
            with np.errstate(invalid="ignore"):  # not a number, of the signalling kind
                return np.asarray(values.astype(np.float64) * _SCALES.get(kinds[column], 1.0))

        def texts(column: str) -> list[str]:
            return [value.split(b"\0")[0].decode("latin-1") for value in rows[column].tolist()]

        return Table(place, declared.columns, numbers, texts, self._units.get(number, {}))

    def _begins(self) -> NDArray[np.int64]:
        """Where messages may begin."""
        head = (self._bytes[:-2] == HEAD[0]) & (self._bytes[1:-1] == HEAD[1])
        return np.flatnonzero(head).astype(np.int64)

    def _declared(self, data: bytes, places: NDArray[np.int64]) -> dict[int, Format]:
        found: dict[int, Format] = {}
        for at in places.tolist():
            declared = _format_in(data[at : at + _FMT_SIZE])
            if declared is not None and found.setdefault(data[at + 3], declared) != declared:
                self.remarks.append(f"{declared.name} is declared twice and differently: what was declared first holds")
        return found

    def _chain(self, begins: NDArray[np.int64]) -> NDArray[np.int64]:
        """Of all places where a message may begin, those of whole messages, each after the end of the one before."""
        sizes = np.zeros(256, np.int64)
        for number, declared in self._formats.items():
            sizes[number] = declared.size
        size = sizes[self._bytes[begins + 2]]
        begins, size = begins[size > 0], size[size > 0]
        ends = begins + size
        whole = ends <= len(self._bytes)
        if not whole.all():
            begins, ends = begins[whole], ends[whole]
        follows = np.flatnonzero(ends[:-1] != begins[1:])
        kept, at, damaged, reached = [], 0, 0, 0
        while at < len(begins):
            damaged += int(begins[at]) - reached
            stop = int(np.searchsorted(follows, at))
            last = int(follows[stop]) if stop < len(follows) else len(begins) - 1
            kept.append(np.arange(at, last + 1))
            reached = int(ends[last])
            at = int(np.searchsorted(begins, reached))
        rest = len(self._bytes) - reached
        if damaged:
            self.remarks.append(f"{damaged} bytes between messages left out")
        if rest > 0 and self._bytes[reached:].any():
            self.remarks.append("ends in the middle of a message: what is whole was read")
        return begins[np.concatenate(kept)] if kept else begins

    def _declared_units(self) -> dict[int, dict[str, str]]:
        """What UNIT and FMTU say of the columns."""
        units, declared = self.table("UNIT"), self.table("FMTU")
        if (
            units is None
            or declared is None
            or not (units.has(["Id", "Label"]) and declared.has(["FmtType", "UnitIds"]))
        ):
            return {}
        words = {
            chr(round(key) & 0xFF): word for key, word in zip(units.column("Id"), units.texts("Label"), strict=True)
        }
        found = {}
        for number, keys in zip(declared.column("FmtType").astype(int), declared.texts("UnitIds"), strict=True):
            if number in self._formats:
                columns = zip(self._formats[number].columns, keys, strict=False)
                found[int(number)] = {column: words.get(key, "") for column, key in columns}
        return found


def _format_in(message: bytes) -> Format | None:
    """What a FMT declares; None when it is none."""
    if len(message) < _FMT_SIZE:
        return None
    size = message[4]
    name, kinds, columns = (
        part.split(b"\0")[0].decode("latin-1") for part in (message[5:9], message[9:25], message[25:89])
    )
    return _format(name, size, kinds, columns)


def _format(name: str, size: int, kinds: str, columns: str) -> Format | None:
    names = tuple(column.strip() for column in columns.split(",")) if columns else ()
    if (
        not _WORD.fullmatch(name)
        or set(kinds) - set(_TYPES)
        or len(names) != len(kinds)
        or len(set(names)) < len(names)
    ):
        return None
    declared = Format(name, size, kinds, names)
    return declared if declared.kinds and declared.layout.itemsize + 3 == size else None


class TextLog:
    """A .log: a line for each message, fields by commas, FMT lines that name them. Numbers are as they were meant."""

    def __init__(self, data: bytes, wanted: frozenset[str]) -> None:
        self.remarks: list[str] = []
        self._columns: dict[str, tuple[str, ...]] = {}
        self._rows: dict[str, list[list[str]]] = {}
        self._places: dict[str, list[int]] = {}
        damaged = 0
        for place, line in enumerate(data.decode("latin-1").splitlines()):
            name = line.partition(",")[0].strip()
            if name != "FMT" and name not in wanted:
                continue
            fields = [field.strip() for field in line.split(",")]
            if name == "FMT":
                if len(fields) > 5:
                    self._columns[fields[3]] = tuple(fields[5:])
                continue
            columns = self._columns.get(name)
            more = -1 if columns is None else len(fields) - len(columns) - 1
            fits = more == 0 or (more > 0 and name == "MSG")  # its text may have commas
            damaged += not fits
            if fits:
                self._rows.setdefault(name, []).append(fields[1:])
                self._places.setdefault(name, []).append(place)
        if damaged:
            self.remarks.append(f"{damaged} lines that are not as declared left out")

    def table(self, name: str) -> Table | None:
        """See DataFlash."""
        rows = self._rows.get(name)
        if not rows:
            return None
        columns = self._columns[name]

        def numbers(column: str) -> Floats:
            at = columns.index(column) if column in columns else None
            if at is None:
                raise KeyError(column)
            return np.array([_number(row[at]) for row in rows])

        def texts(column: str) -> list[str]:
            at = columns.index(column)
            return [row[at] for row in rows]

        return Table(np.array(self._places[name], np.int64), columns, numbers, texts, {})


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return np.nan
