"""PX4's logs (.ulg): topics as columns (https://docs.px4.io/main/en/dev_log/ulog_file_format.html).

Messages are `size u16, type u8`, then `size` bytes, one after the other. Once it is known where each begins, those of a
topic are one array. Several logs in one file are read as several; what a log has appended (as after a crash) is part of
it.
"""

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from dob_companion.errors import LogError
from dob_companion.identification.record import Floats
from dob_companion.logs.columns import Table
from dob_companion.logs.series import places_by_time

MAGIC = b"ULog\x01\x12\x35"
_SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
_HEADER = 16
_KINDS = frozenset(b"FDIMPQARSOLCB")
_DATA = ord("D")
_MESSAGE = struct.Struct("<HB")

_TYPES = {
    "int8_t": "i1", "uint8_t": "u1", "int16_t": "<i2", "uint16_t": "<u2", "int32_t": "<i4", "uint32_t": "<u4",
    "int64_t": "<i8", "uint64_t": "<u8", "float": "<f4", "double": "<f8", "bool": "?", "char": "S1",
}  # fmt: skip
_FIELD = re.compile(r"([\w\-/]+)(?:\[(\d+)\])? (\w+)")
_INDEXED = re.compile(r"(\w+)\[(\d+)\]")
_DEEPEST = 8
_APPENDED = 1


def pieces(data: bytes) -> Iterator[bytes]:
    """The logs in a file, one after the other."""
    begins = [match.start() for match in re.finditer(re.escape(MAGIC), data)]
    for begin, end in zip(begins, [*begins[1:], len(data)], strict=True):
        yield data[begin:end]


@dataclass(slots=True)
class _Definitions:
    """What a log says of its topics. `topics`: number to name and instance."""

    formats: dict[str, str] = field(default_factory=dict)
    topics: dict[int, tuple[str, int]] = field(default_factory=dict)
    settings: list[tuple[int, str, float]] = field(default_factory=list)
    lost_ms: int = 0


class ULog:
    """One log. `settings` are its parameters: place, name, value. Raises LogError, without the file's name."""

    def __init__(self, data: bytes) -> None:
        self.remarks: list[str] = []
        self._data, self._said = data, _Definitions()
        if len(data) < _HEADER:
            raise LogError("ends within its header")
        self._samples = np.array(self._walk(), np.int64)
        self._bytes = np.frombuffer(data, np.uint8)
        at = self._samples
        self._topic = self._bytes[at + 3].astype(int) | self._bytes[at + 4].astype(int) << 8
        self._size = self._bytes[at].astype(int) | self._bytes[at + 1].astype(int) << 8
        self._grouped = 0 < int((np.diff(self._topic) != 0).sum()) < 2 * len(self._said.topics)
        if self._grouped:
            self.remarks.append(
                "written topic by topic, as by a tool that rewrites logs: their order is by their stamps"
            )
        if self._said.lost_ms:
            self.remarks.append(f"the logger lost data, {1e-3 * self._said.lost_ms:.3g} s in all")

    @property
    def settings(self) -> list[tuple[int, str, float]]:
        """Parameters in the log's order: place, name, value."""
        return self._said.settings

    def table(self, name: str, instance: int = 0) -> Table | None:
        """The samples of a topic; None where there is none."""
        number = next((number for number, topic in self._said.topics.items() if topic == (name, instance)), None)
        layout = self._layout(name)
        if number is None or layout is None:
            return None
        place = self._samples[(self._topic == number) & (self._size >= layout.itemsize + 2)]
        if not len(place):
            return None
        windows = np.lib.stride_tricks.sliding_window_view(self._bytes, layout.itemsize)
        rows = windows[place + 5].copy().view(layout)[:, 0]

        def numbers(column: str) -> Floats:
            indexed = _INDEXED.fullmatch(column)
            values = rows[indexed[1]][:, int(indexed[2])] if indexed else rows[column]
            with np.errstate(invalid="ignore"):  # not a number, of the signalling kind
                return np.asarray(values.astype(np.float64))

        def texts(column: str) -> list[str]:
            raise KeyError(column)

        if self._grouped and "timestamp" in (layout.names or ()):
            place = places_by_time(1e-6 * numbers("timestamp"))
        return Table(place, _names(layout), numbers, texts, {})

    def _walk(self) -> list[int]:
        """Where each sample of a topic begins; takes in the definitions on the way."""
        found: list[int] = []
        data, damaged, begin = self._data, 0, _HEADER
        head, keep = _MESSAGE.unpack_from, found.append  # this loop is most of what reading costs
        for end in self._sections():
            at, last = begin, end - _MESSAGE.size
            while at <= last:
                size, kind = head(data, at)
                after = at + 3 + size
                if kind == _DATA and size > 2 and after <= end:
                    keep(at)
                elif kind not in _KINDS or not size:
                    sync = data.find(_SYNC, at, end)
                    after = sync + len(_SYNC) if sync >= 0 else end
                    damaged += after - at
                elif after > end:
                    break
                elif kind != _DATA:
                    self._define(at, chr(kind), data[at + 3 : after])
                at = after
            if at < end:
                self.remarks.append("ends in the middle of a message: what is whole was read")
            begin = end
        if damaged:
            self.remarks.append(f"{damaged} damaged bytes left out")
        return found

    def _sections(self) -> list[int]:
        """Ends of the log itself and of each part appended to it; the flags that say so come first, if at all."""
        data = self._data
        whole = [len(data)]
        if data[_HEADER + 2 : _HEADER + 3] != b"B" or len(data) < _HEADER + 3 + 40:
            return whole
        flags = data[_HEADER + 11 : _HEADER + 19]
        if flags[0] & ~_APPENDED or any(flags[1:]):
            raise LogError("of a newer format than is known: an unknown incompatible flag is set")
        offsets = struct.unpack_from("<3Q", data, _HEADER + 19) if flags[0] & _APPENDED else ()
        appended = [offset for offset in offsets if _HEADER < offset < len(data)]
        if appended:
            self.remarks.append(f"{len(appended)} parts are appended: read as well")
        return sorted(appended) + whole

    def _define(self, at: int, kind: str, content: bytes) -> None:
        said = self._said
        if kind == "F":
            name, _, fields = content.decode("latin-1").partition(":")
            said.formats[name] = fields
        elif kind == "A" and len(content) > 3:
            said.topics.setdefault(content[1] | content[2] << 8, (content[3:].decode("latin-1"), content[0]))
        elif kind == "P" and (setting := _setting(content)) is not None:
            said.settings.append((at, *setting))
        elif kind == "O" and len(content) >= 2:
            said.lost_ms += content[0] | content[1] << 8

    def _layout(self, name: str, depth: int = 0) -> "np.dtype[np.void] | None":
        """The fields of a topic, nested ones as well; None where they are not declared as they should be."""
        declared = self._said.formats.get(name)
        if declared is None or depth > _DEEPEST:
            return None
        fields: list[tuple[str, object, tuple[int, ...]]] = []
        for words in filter(None, declared.split(";")):
            match = _FIELD.fullmatch(words.strip())
            if match is None:
                return None
            of = _TYPES.get(match[1]) or self._layout(match[1], depth + 1)
            if of is None or any(match[3] == known for known, *_ in fields):
                return None
            fields.append((match[3], of, (int(match[2]),) if match[2] else ()))
        if depth == 0 and fields and fields[-1][0].startswith("_padding"):
            fields.pop()  # is not written
        return np.dtype(fields) if fields else None


def _names(layout: "np.dtype[np.void]") -> tuple[str, ...]:
    """Names of the numbers, those of arrays as `name[0]`."""
    found: list[str] = []
    for name in layout.names or ():
        part = layout[name]
        if part.base.kind in "iufb":
            found += [f"{name}[{k}]" for k in range(part.shape[0])] if part.shape else [name]
    return tuple(found)


def _setting(content: bytes) -> tuple[str, float] | None:
    """Name and value in a parameter message."""
    length = content[0] if content else 0
    kind, _, name = content[1 : 1 + length].decode("latin-1").partition(" ")
    layout = {"int32_t": "<i", "float": "<f"}.get(kind)
    if layout is None or len(content) < 1 + length + 4:
        return None
    return name, float(struct.unpack_from(layout, content, 1 + length)[0])
