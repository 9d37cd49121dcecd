"""Models from other tools: `file = "plant.mat"` (or .npz) in a spec stands for the A, B, C, D that it holds.

Both kinds hold matrices named A, B, C, D and, if they like, a sample time Ts or dt (0 or absent: continuous time,
to be discretized with the spec's `method`). Pure: the bytes come from the caller's `read`.
"""

import io
from collections.abc import Callable, Mapping
from typing import Any, cast

import numpy as np
from scipy.io import loadmat

from dob_companion.errors import InputError, SpecError

Reader = Callable[[str], bytes]
"""From a path as the spec writes it to the file's content; raises InputError when it cannot be read."""

MATRICES = ("A", "B", "C", "D")
_SAMPLE_TIMES = ("Ts", "dt")


def with_model_files(raw: Mapping[str, Any], source: str, read: Reader | None) -> dict[str, Any]:
    """The spec's raw table with every `file` key in its blocks replaced by what the file holds.

    Raises SpecError, one line that names `source`, the key and the file.
    """
    rate = raw.get("design", {}).get("rate_hz") if isinstance(raw.get("design"), dict) else None
    blocks = raw.get("block")
    if not isinstance(blocks, list):
        return dict(raw)
    return dict(raw) | {"block": [_walk(block, f"{source}: block", rate, read) for block in blocks]}


def _walk(node: Any, where: str, rate: Any, read: Reader | None) -> Any:
    if isinstance(node, list):
        return [_walk(item, where, rate, read) for item in node]
    if not isinstance(node, dict):
        return node
    inner = {key: _walk(value, f"{where}.{key}", rate, read) for key, value in node.items() if key != "file"}
    return inner if "file" not in node else inner | _from_file(node["file"], f"{where}.file", inner, rate, read)


def _from_file(name: Any, where: str, beside: Mapping[str, Any], rate: Any, read: Reader | None) -> dict[str, Any]:
    if not (isinstance(name, str) and name.endswith((".mat", ".npz"))):
        raise SpecError(f"{where} is {name!r}, expected the name of a .mat or .npz file")
    twice = [key for key in MATRICES if key in beside]
    if twice:
        raise SpecError(f"{where}: {name} stands beside {', '.join(twice)}; expected one or the other")
    if read is None:
        raise SpecError(f"{where}: {name}: a spec given as text alone cannot name files")
    try:
        found = _loaded(name, read(name))
    except InputError as problem:
        raise SpecError(f"{where}: {problem}") from None
    except Exception as problem:  # whatever the readers of these formats raise on foreign bytes
        raise SpecError(f"{where}: {name}: not a file of matrices: {' '.join(str(problem).split())}") from None
    missing = [key for key in MATRICES if key not in found]
    if missing:
        raise SpecError(f"{where}: {name}: {', '.join(missing)} is missing; expected matrices A, B, C and D")
    matrices = {key: _rows(found[key], f"{where}: {name}: {key}") for key in MATRICES}
    return matrices | _domain(found, f"{where}: {name}", beside, rate)


def _loaded(name: str, data: bytes) -> dict[str, Any]:
    if name.endswith(".mat"):
        return dict(loadmat(cast(Any, io.BytesIO(data))))  # the stubs know paths only
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        return {key: archive[key] for key in archive.files}


def _rows(value: Any, where: str) -> list[list[float]]:
    array = np.atleast_2d(np.asarray(value))
    if array.ndim != 2 or array.dtype.kind not in "fiu":
        raise SpecError(f"{where}: expected a real matrix, got {array.ndim} dimensions of {array.dtype}")
    return [[float(x) for x in row] for row in array] if array.size else []


def _domain(found: Mapping[str, Any], where: str, beside: Mapping[str, Any], rate: Any) -> dict[str, str]:
    named = next((key for key in _SAMPLE_TIMES if key in found), None)
    step = float(np.asarray(found[named]).reshape(-1)[0]) if named else 0.0
    if step > 0.0:
        if not isinstance(rate, int | float) or abs(step * rate - 1.0) > 1e-6:
            raise SpecError(
                f"{where}: {named} is {step:g} s, expected 1 / design.rate_hz; resample it where it comes from"
            )
        return {"domain": "z"}
    return {} if "domain" in beside else {"domain": "s"}
