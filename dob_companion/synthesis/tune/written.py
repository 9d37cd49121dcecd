"""The spec with the weights that were found in it, as TOML: `design` makes the same observers of it again."""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from dob_companion.synthesis.spec.model_file import Reader
from dob_companion.synthesis.spec.parse import Matrices, Zpk, read_spec
from dob_companion.synthesis.tune.limits import Tuning


def tuned_spec(text: str, source: str, read: Reader | None, tunings: Sequence[Tuning]) -> str:
    """What `text` asks, models from files written out, each block with its weights, back-off and number of states."""
    raw = read_spec(text, source, read)
    by_name = {tuning.name: tuning for tuning in tunings}
    blocks = [_weighted(block, by_name[block["name"]]) for block in raw["block"]]
    head = (
        f"# {' '.join(source.split())}, with the weights that `dob-companion design --auto` found for it.\n"
        "# The same design again:  dob-companion design THIS_FILE -o my-design\n\n"
    )
    return head + "\n".join(_lines(raw | {"block": blocks})).lstrip("\n") + "\n"


def weight_table(form: Zpk | Matrices) -> dict[str, Any]:
    """As a spec states it: one [re, im] for a pair, matrices as nested rows."""
    if isinstance(form, Matrices):
        return {name: [list(row) for row in getattr(form, name)] for name in "ABCD"}

    def listed(roots: Sequence[complex]) -> list[Any]:
        return [root.real if root.imag == 0.0 else [root.real, root.imag] for root in roots if root.imag >= 0.0]

    return {"zeros": listed(form.zeros), "poles": listed(form.poles), "gain": form.gain}


def _weighted(block: Mapping[str, Any], tuning: Tuning) -> dict[str, Any]:
    axes = block["axes"]
    noise = [weight_table(form) for form in tuning.noise]
    weights = {
        "disturbance": weight_table(tuning.disturbance),
        "noise": noise[0] if len(axes) == 1 else dict(zip(axes, noise, strict=True)),
    }
    order = {} if tuning.order is None else {"largest_order": tuning.order}
    stated = {}  # the observer of one axis bears its uncertainty already
    if "uncertainty" in block and len(axes) == 1:
        stated["uncertainty"] = dict(block["uncertainty"]) | {"synthesis": "nominal"}
    return dict(block) | stated | order | {"gamma_backoff": tuning.gamma_backoff, "weights": weights}


def _lines(table: Mapping[str, Any], path: str = "") -> Iterator[str]:
    """A table's plain values, then its tables and arrays of tables under their own heads."""
    inner = {key: value for key, value in table.items() if isinstance(value, dict) or _is_tables(value)}
    for key, value in table.items():
        if key not in inner:
            yield f"{_key(key)} = {_value(value)}"
    for key, value in inner.items():
        name = f"{path}{_key(key)}"
        for item in value if isinstance(value, list) else [value]:
            yield ""
            yield f"[[{name}]]" if isinstance(value, list) else f"[{name}]"
            yield from _lines(item, f"{name}.")


def _is_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(item, dict) for item in value)


def _key(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else json.dumps(key)


def _value(value: Any) -> str:
    """TOML of a string, number, truth, or array of such."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{_key(key)} = {_value(item)}' for key, item in value.items())} }}"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)
