"""The companion's state as plain data, so that a recorded flight can be taken up in its middle.

A snapshot names every value by its path, `loop.shaper.f`, and holds only those that differ from a companion just built
from the same design and configuration: matrices and settings are not state, and nobody has to list what is. It is
restored onto such a newborn. Values are numbers, texts, containers of them, numpy arrays, enumerations and dataclasses
of the rooms below, and profiles by their names; nothing else is written and nothing else is ever built, so that a
snapshot cannot do anything.

A value that this cannot write raises SnapshotError, and so does a path that the program does not have: it was then
recorded by another version.
"""

import base64
import sys
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np

from dob_companion.mavlink import profiles
from dob_companion.mavlink.profiles import Profile

ROOMS = ("artifact", "companion", "lti", "mavlink", "observer", "supervisor")
"""Whose objects are looked into, and whose dataclasses and enumerations may be values."""

PARSER = {
    "MAVLink": ("seq", "srcSystem", "srcComponent", "buf", "buf_index", "expected_length", "have_prefix_error"),
}
"""What of pymavlink's objects is state."""

_PLAIN = (bool, int, float, str, type(None))
_IN_PLACE = (list, deque, set, dict)
_MISSING = object()

State = Mapping[str, Any]
"""Path to value, as JSON can hold it."""


class SnapshotError(ValueError):
    """A value that a snapshot cannot hold, or a snapshot that does not fit this program."""


@dataclass(frozen=True, slots=True)
class _Place:
    """Where a value lies, and what it is for now."""

    path: str
    value: Any
    put: Callable[[Any], None]


class Snapshots:
    """Takes snapshots relative to `newborn`, a companion just built that is kept as it is."""

    def __init__(self, newborn: object) -> None:
        self._plain = {place.path: repr(_encode(place.value, place.path)) for place in _places(newborn)}

    def take(self, companion: object) -> dict[str, Any]:
        """The state of a companion built from the same design and configuration; it is not touched."""
        state = {place.path: _encode(place.value, place.path) for place in _places(companion)}
        return {path: value for path, value in state.items() if repr(value) != self._plain.get(path)}


def restore(newborn: object, state: State) -> None:
    """Bring a companion just built into the state of a snapshot."""
    places = {place.path: place for place in _places(newborn)}
    for path, code in state.items():
        place = places.get(path)
        if place is None:
            raise SnapshotError(f"state {path!r} is not known to this program")
        _put(place, _decode(code, path))


def difference(expected: State, found: State) -> str:
    """The first path at which two snapshots differ; "" when none does. NaN equals NaN, -0.0 differs from 0.0."""
    paths = sorted(expected.keys() | found.keys())
    return next((p for p in paths if repr(expected.get(p, _MISSING)) != repr(found.get(p, _MISSING))), "")


def _put(place: _Place, value: Any) -> None:
    """Containers are filled in place: another part may hold the same one."""
    old = place.value
    if type(old) is not type(value) or not isinstance(old, _IN_PLACE):
        place.put(value)
        return
    old.clear()
    (old.extend if isinstance(old, list | deque) else old.update)(value)


# The tree of parts ----------------------------------------------------------------------------------------------


def _places(part: object) -> Iterator[_Place]:
    yield from _attributes(part, "", {id(part)})


def _attributes(part: object, prefix: str, seen: set[int]) -> Iterator[_Place]:
    for name in _names(part):
        value = getattr(part, name, _MISSING)
        if value is not _MISSING and not callable(value):
            put = _setter(part, name)
            yield from _look(_Place(prefix + name, value, put), seen)


def _look(place: _Place, seen: set[int]) -> Iterator[_Place]:
    """The place itself, or the places within, when its value is a part or a container of parts."""
    value = place.value
    if _is_part(value):
        if id(value) not in seen:
            seen.add(id(value))
            yield from _attributes(value, place.path + ".", seen)
    elif isinstance(value, list | tuple) and any(map(_is_part, value)):
        for index, element in enumerate(value):
            yield from _look(_Place(f"{place.path}[{index}]", element, _fixed(place.path)), seen)
    elif isinstance(value, dict) and any(map(_is_part, value.values())):
        for key, element in value.items():
            yield from _look(_Place(f"{place.path}[{key!r}]", element, _fixed(place.path)), seen)
    else:
        yield place


def _is_part(value: object) -> bool:
    """Whether it is an object with a life of its own, rather than a value that is replaced as a whole."""
    kind = type(value)
    if kind.__name__ in PARSER and kind.__module__.startswith("pymavlink."):
        return True
    if not _ours(kind) or isinstance(value, Enum):
        return False
    return not is_dataclass(kind) or not kind.__dataclass_params__.frozen  # type: ignore[attr-defined]


def _names(part: object) -> list[str]:
    kind = type(part)
    if not _ours(kind):
        return list(PARSER[kind.__name__])
    slots = [name for base in reversed(kind.__mro__) for name in _slots(base)]
    return [*slots, *getattr(part, "__dict__", ())]


def _slots(kind: type) -> tuple[str, ...]:
    slots = kind.__dict__.get("__slots__", ())
    named = (slots,) if isinstance(slots, str) else tuple(slots)
    return tuple(name for name in named if name not in ("__dict__", "__weakref__"))


def _ours(kind: type) -> bool:
    package, _, rest = kind.__module__.partition(".")
    return package == "dob_companion" and rest.partition(".")[0] in ROOMS


def _setter(part: object, name: str) -> Callable[[Any], None]:
    return lambda value: setattr(part, name, value)


def _fixed(path: str) -> Callable[[Any], None]:
    def refuse(_: Any) -> None:
        raise SnapshotError(f"state {path!r} holds parts beside values")

    return refuse


# Values as JSON -------------------------------------------------------------------------------------------------


def _encode(value: Any, path: str) -> Any:
    """Plain values as they are, everything else as {kind: content}."""
    kind = type(value)
    if kind in _PLAIN:
        return value
    writer = _WRITERS.get(kind)
    if writer is not None:
        return {kind.__name__: writer(value, path)}
    if isinstance(value, np.generic):
        return {"number": [value.dtype.str, value.tobytes().hex()]}
    if _ours(kind) and isinstance(value, Enum):
        return {"enum": [kind.__module__, kind.__qualname__, value.name]}
    if _ours(kind) and is_dataclass(kind):
        content = [_encode(getattr(value, field.name), path) for field in fields(kind)]
        return {"dataclass": [kind.__module__, kind.__qualname__, content]}
    raise SnapshotError(f"state {path!r} holds {kind.__module__}.{kind.__qualname__}, which a snapshot cannot")


def _elements(values: Any, path: str) -> list[Any]:
    plain = list(values)
    return plain if {*map(type, plain)} <= {*_PLAIN} else [_encode(value, path) for value in plain]


def _bytes_of(array: Any, _path: str) -> list[Any]:
    data = base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
    return [array.dtype.str, list(array.shape), data]


def _pairs_of(mapping: Any, path: str) -> list[Any]:
    return [_elements(pair, path) for pair in mapping.items()]


_WRITERS: dict[type, Callable[[Any, str], Any]] = {
    list: _elements,
    tuple: _elements,
    deque: _elements,
    set: lambda value, path: _elements(sorted(value), path),
    frozenset: lambda value, path: _elements(sorted(value), path),
    dict: _pairs_of,
    Counter: _pairs_of,
    np.ndarray: _bytes_of,
    bytes: lambda value, _: value.hex(),
    bytearray: lambda value, _: value.hex(),
    Profile: lambda value, _: value.name,
}


def _decode(code: Any, path: str) -> Any:
    if not isinstance(code, dict):
        return code
    try:
        ((kind, content),) = code.items()
        return _BUILDERS[kind](content, path)
    except (KeyError, ValueError, TypeError, AttributeError) as problem:
        raise SnapshotError(f"state {path!r} cannot be read: {problem}") from None


def _listed(content: Any, path: str) -> list[Any]:
    return [_decode(element, path) for element in content]


def _array(content: Any, _path: str) -> Any:
    dtype, shape, data = content
    return np.frombuffer(base64.b64decode(data), dtype=dtype).reshape(shape).copy()


def _pairs(content: Any, path: str) -> dict[Any, Any]:
    return {_decode(key, path): _decode(value, path) for key, value in content}


def _enum(content: Any, _path: str) -> Any:
    module, name, member = content
    return _class(module, name, Enum)[member]


def _dataclass(content: Any, path: str) -> Any:
    module, name, values = content
    kind: Any = _class(module, name, object)
    if "__dataclass_fields__" not in vars(kind):
        raise ValueError(f"{name} is no dataclass")
    names = [field.name for field in fields(kind)]
    return kind(**dict(zip(names, _listed(values, path), strict=True)))


def _class(module: str, name: str, base: type) -> Any:
    """A class of our own rooms by its name: a snapshot cannot name any other."""
    kind = getattr(sys.modules[module], name)
    if not (isinstance(kind, type) and _ours(kind) and issubclass(kind, base)):
        raise ValueError(f"{module}.{name} is not a value of this program")
    return kind


_BUILDERS: dict[str, Callable[[Any, str], Any]] = {
    "ndarray": _array,
    "number": lambda content, _: np.frombuffer(bytes.fromhex(content[1]), dtype=content[0])[0],
    "bytes": lambda content, _: bytes.fromhex(content),
    "bytearray": lambda content, _: bytearray.fromhex(content),
    "list": _listed,
    "tuple": lambda content, path: tuple(_listed(content, path)),
    "deque": lambda content, path: deque(_listed(content, path)),
    "set": lambda content, path: set(_listed(content, path)),
    "frozenset": lambda content, path: frozenset(_listed(content, path)),
    "dict": _pairs,
    "Counter": lambda content, path: Counter(_pairs(content, path)),
    "Profile": lambda content, _: profiles.named(content),
    "enum": _enum,
    "dataclass": _dataclass,
}
