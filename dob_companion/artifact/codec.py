"""design.json as text: written so that every float reads back bit for bit, and sealed by a hash.

The hash catches accidents (a hand edit, a torn copy), not forgery.
"""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from typing import Any, TypeVar

from dob_companion.artifact.design import (
    MOMENT_UNIT,
    RATE_UNIT,
    Certificate,
    DobBlock,
    DobDesign,
    Problem,
)
from dob_companion.errors import DesignFileError
from dob_companion.lti.statespace import StateSpaceData

SCHEMA = "dob-companion/design/1"

_T = TypeVar("_T")

_UNITS = {"y_n": RATE_UNIT, "u_e": MOMENT_UNIT, "d_hat": MOMENT_UNIT}
_CERTIFIED = {f.name: f.type for f in fields(Certificate) if f.name != "extra"}


def sha256_of(obj: Mapping[str, Any]) -> str:
    """Hash of a design object without its own `sha256` key (docs/interfaces.md, design.json)."""
    bare = {key: value for key, value in obj.items() if key != "sha256"}
    text = json.dumps(bare, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def dumps(design: DobDesign) -> tuple[str, DobDesign]:
    """The file's text, and the design with its hash filled in. Raises ValueError on a non-finite number."""
    obj = {
        "schema": SCHEMA,
        "created": design.created,
        "generator": design.generator,
        "dt": design.dt,
        "delay_samples": design.delay_samples,
        "blocks": [_block_object(block) for block in design.blocks],
    }
    digest = sha256_of(obj)
    text = json.dumps(obj | {"sha256": digest}, indent=1, ensure_ascii=False, allow_nan=False)
    return text + "\n", replace(design, sha256=digest)


def loads(text: str, source: str = "design.json") -> DobDesign:
    """Read a design and check its schema, hash, names and shapes.

    Raises DesignFileError, one line that begins with `source`.
    """
    try:
        obj = json.loads(text, parse_constant=_no_constants)
        digest = sha256_of(obj) if isinstance(obj, dict) else ""  # fails on 1e999 and on half a surrogate pair
    except (ValueError, RecursionError) as problem:
        raise DesignFileError(f"{source}: not JSON: {problem}") from None
    if not isinstance(obj, dict):
        raise DesignFileError(f"{source}: expected a JSON object")
    reader = _Reader(source, obj)
    schema = reader.text("schema")
    if schema != SCHEMA:
        raise DesignFileError(f"{source}: schema is {schema!r}, expected {SCHEMA!r}")
    stated = reader.text("sha256")
    if stated != digest:
        raise DesignFileError(
            f"{source}: sha256 does not match: the file was changed after it was certified; run design again"
        )
    blocks = obj.get("blocks")
    if not isinstance(blocks, list):
        raise DesignFileError(f"{source}: blocks: expected a list")
    return reader.build(
        lambda: DobDesign(
            dt=reader.number("dt"),
            delay_samples=reader.whole("delay_samples"),
            blocks=tuple(_read_block(source, index, item) for index, item in enumerate(blocks)),
            created=reader.text("created"),
            generator=reader.text("generator"),
            sha256=stated,
        )
    )


def _block_object(block: DobBlock) -> dict[str, Any]:
    problem = block.problem
    certificate = {name: getattr(block.certificate, name) for name in _CERTIFIED}
    return {
        "name": block.name,
        "axes": list(block.axes),
        "delay_samples": block.delay_samples,
        "inputs": list(block.inputs),
        "outputs": list(block.outputs),
        "units": _UNITS,
        **_system_object(block.observer),
        "problem": {
            "plant": _system_object(problem.plant),
            "controller": _system_object(problem.controller),
            "weights": {
                "disturbance": _system_object(problem.disturbance_weight),
                "noise": _system_object(problem.noise_weight),
            },
        },
        "certificate": certificate | dict(block.certificate.extra),
    }


def _system_object(system: StateSpaceData) -> dict[str, Any]:
    return {name: getattr(system, name).tolist() for name in "ABCD"}


def _read_block(source: str, index: int, obj: Any) -> DobBlock:
    reader = _Reader(f"{source}: blocks[{index}]", obj)
    problem = reader.inner("problem")
    weights = problem.inner("weights")
    block = reader.build(
        lambda: DobBlock(
            name=reader.text("name"),
            axes=tuple(reader.texts("axes")),
            delay_samples=reader.whole("delay_samples"),
            observer=reader.system(),
            problem=Problem(
                plant=problem.inner("plant").system(),
                controller=problem.inner("controller").system(),
                disturbance_weight=weights.inner("disturbance").system(),
                noise_weight=weights.inner("noise").system(),
            ),
            certificate=_read_certificate(reader.inner("certificate")),
        )
    )
    for key, expected in (("inputs", block.inputs), ("outputs", block.outputs)):
        if tuple(reader.texts(key)) != expected:
            raise DesignFileError(f"{reader.where}.{key}: expected {list(expected)}")
    if reader.get("units") != _UNITS:
        raise DesignFileError(f"{reader.where}.units: expected {_UNITS}")
    return block


def _read_certificate(reader: "_Reader") -> Certificate:
    read: dict[Any, Callable[[str], Any]] = {str: reader.text, int: reader.whole, float: reader.number}
    named = {name: read[kind](name) for name, kind in _CERTIFIED.items()}
    return Certificate(**named, extra={k: v for k, v in reader.obj.items() if k not in _CERTIFIED})


def _no_constants(name: str) -> float:
    raise ValueError(f"{name} is not a finite number")


class _Reader:
    """Typed access to one JSON object; every complaint names the place."""

    def __init__(self, where: str, obj: Any) -> None:
        if not isinstance(obj, dict):
            raise DesignFileError(f"{where}: expected a JSON object")
        self.where, self.obj = where, obj

    def get(self, key: str) -> Any:
        if key not in self.obj:
            raise DesignFileError(f"{self.where}: key {key!r} is missing")
        return self.obj[key]

    def inner(self, key: str) -> "_Reader":
        return _Reader(f"{self.where}.{key}", self.get(key))

    def text(self, key: str) -> str:
        value = self.get(key)
        if not isinstance(value, str):
            raise DesignFileError(f"{self.where}.{key}: expected a string")
        return value

    def texts(self, key: str) -> list[str]:
        value = self.get(key)
        if not (isinstance(value, list) and all(isinstance(item, str) for item in value)):
            raise DesignFileError(f"{self.where}.{key}: expected a list of strings")
        return value

    def number(self, key: str) -> float:
        value = self.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise DesignFileError(f"{self.where}.{key}: expected a finite number")
        return self.build(lambda: float(value))  # JSON knows no bounds for whole numbers

    def whole(self, key: str) -> int:
        value = self.get(key)
        if isinstance(value, bool) or not isinstance(value, int):
            raise DesignFileError(f"{self.where}.{key}: expected a whole number")
        return value

    def system(self) -> StateSpaceData:
        return self.build(lambda: StateSpaceData(*(self.get(name) for name in "ABCD")))

    def build(self, make: Callable[[], _T]) -> _T:
        try:
            return make()
        except DesignFileError:
            raise
        except (ValueError, TypeError, OverflowError) as problem:
            raise DesignFileError(f"{self.where}: {problem}") from None
