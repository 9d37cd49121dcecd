"""Models from other tools: `file = "plant.mat"` (or .npz) in a spec stands for the A, B, C, D that it holds.

Both kinds hold matrices named A, B, C, D and, if they like, a sample time Ts or dt in s (0 or absent: continuous time,
to be discretized with the spec's `method`). MATLAB's -1 and python-control's True, discrete of no stated sample time,
need `domain = "z"` in the spec. Pure: the bytes come from the caller's `read`.
"""

import io
import warnings
from collections.abc import Callable, Mapping
from typing import Any, cast

import numpy as np
from scipy import sparse
from scipy.io import loadmat

from dob_companion.errors import InputError, SpecError
from dob_companion.toml import is_number, shown

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
    if not (isinstance(name, str) and name.lower().endswith((".mat", ".npz"))):
        raise SpecError(f"{where} is {shown(name)}, expected the name of a .mat or .npz file")
    twice = [key for key in MATRICES if key in beside]
    if twice:
        raise SpecError(f"{where}: {name} stands beside {', '.join(twice)}; expected one or the other")
    if read is None:
        raise SpecError(f"{where}: {name}: a spec given as text alone cannot name files")
    try:
        found = _loaded(name, read(name))
    except InputError as problem:
        raise SpecError(f"{where}: {problem}") from None
    except NotImplementedError:
        raise SpecError(
            f"{where}: {name}: a MATLAB v7.3 (HDF5) file, expected an older format: save('{name}', …, '-v7')"
        ) from None
    except Exception as problem:  # whatever the readers of these formats raise on foreign bytes
        raise SpecError(f"{where}: {name}: not a file of matrices: {' '.join(str(problem).split())}") from None
    place = f"{where}: {name}"
    missing = [key for key in MATRICES if key not in found]
    if missing:
        others = ", ".join(key for key in found if not key.startswith("__"))
        raise SpecError(
            f"{place}: {', '.join(missing)} is missing; expected matrices A, B, C and D"
            + (f", got {others} (of an ss object: [A, B, C, D] = ssdata(sys); Ts = sys.Ts;)" if others else "")
        )
    matrices = {key: _rows(found[key], f"{place}: {key}") for key in MATRICES}
    return matrices | _domain(found, place, beside, rate)


def _loaded(name: str, data: bytes) -> dict[str, Any]:
    if name.lower().endswith(".mat"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of variables that are not asked for
            return dict(loadmat(cast(Any, io.BytesIO(data))))  # the stubs know paths only
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        return {key: _unpickled(archive, key) for key in archive.files}


def _unpickled(archive: Any, key: str) -> Any:
    """The array; an empty one of objects where it holds Python's own, such as None."""
    try:
        return archive[key]
    except ValueError:
        if key in (*MATRICES, *_SAMPLE_TIMES):
            return np.empty(0, dtype=object)
        return None


def _rows(value: Any, where: str) -> list[list[float]]:
    dense = cast(Any, value).toarray() if sparse.issparse(value) else value
    array = np.atleast_2d(np.asarray(dense))
    if array.ndim != 2 or array.dtype.kind not in "fiu":
        raise SpecError(f"{where}: expected a real matrix, got {_described(array)}")
    return [[float(x) for x in row] for row in array] if array.size else []


def _described(array: Any) -> str:
    kinds = {"O": "a cell, struct or object", "b": "true or false", "c": "complex numbers", "U": "text", "S": "text"}
    return kinds.get(array.dtype.kind, f"{array.ndim} dimensions of {array.dtype}")


def _domain(found: Mapping[str, Any], where: str, beside: Mapping[str, Any], rate: Any) -> dict[str, str]:
    """What the file's sample time and the spec's `domain` agree on: never one against the other."""
    steps = {key: _sample_time(found[key], f"{where}: {key}") for key in _SAMPLE_TIMES if key in found}
    if not steps:
        return {} if "domain" in beside else {"domain": "s"}
    key, step = next(iter(steps.items()))
    if len(set(steps.values())) > 1:
        raise SpecError(f"{where}: Ts and dt differ: {_step_words(steps['Ts'])} and {_step_words(steps['dt'])}")
    said = beside.get("domain")
    if step is None and said is None:
        raise SpecError(
            f'{where}: {key} is {_step_words(step)}: expected seconds, or domain = "z" beside the file when '
            "it is discrete at design.rate_hz"
        )
    domain = "s" if step == 0.0 else "z"
    if said is not None and said != domain:
        raise SpecError(f"{where}: {key} is {_step_words(step)}, but domain = {shown(said)} stands beside the file")
    if step and (not is_number(rate) or not abs(step * float(rate) - 1.0) <= 1e-6):
        raise SpecError(f"{where}: {key} is {step:g} s, expected 1 / design.rate_hz; resample it where it comes from")
    return {"domain": domain}


def _sample_time(value: Any, where: str) -> float | None:
    """In s; 0 for continuous time, None for discrete time of no stated step."""
    array = np.asarray(value)
    if array.dtype.kind == "b" and array.size == 1 and bool(array.item()):
        return None
    if array.dtype.kind not in "fiu":
        raise SpecError(f"{where}: expected a number of s, got {_described(array)}")
    if array.size != 1:
        raise SpecError(f"{where}: expected a number of s, got {array.size or 'none'}")
    step = float(array.item())
    if step == -1.0:
        return None
    if not 0.0 <= step < np.inf:
        raise SpecError(f"{where}: is {step:g}, expected a number of s: positive, or 0 for continuous time")
    return step


def _step_words(step: float | None) -> str:
    if step is None:
        return "-1 or true (discrete, its sample time not stated)"
    return f"{step:g} s" if step else "0 (continuous)"
