"""A measured spectrum from a file: `disturbance_spectrum = "wind.csv"` in [auto] stands for the table that it holds.

Two columns, frequency in Hz and power density in any unit, separated by a comma or blanks; one line of words above them
is passed over. Pure: the bytes come from the caller's `read`.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from dob_companion.errors import InputError, SpecError
from dob_companion.synthesis.spec.model_file import Reader


def with_spectrum_file(raw: Mapping[str, Any], source: str, read: Reader | None) -> dict[str, Any]:
    """The spec's raw table with the file's two columns in place of its name.

    Raises SpecError, one line that names `source`, the key and the file.
    """
    found = _read_out(dict(raw), source, read)
    blocks = raw.get("block")
    if not isinstance(blocks, list):
        return found
    place = f"{source}: block"
    return found | {"block": [_read_out(each, place, read) if isinstance(each, dict) else each for each in blocks]}


def _read_out(holder: dict[str, Any], source: str, read: Reader | None) -> dict[str, Any]:
    """A table that may hold an [auto]."""
    auto = holder.get("auto")
    name = auto.get("disturbance_spectrum") if isinstance(auto, dict) else None
    if not isinstance(auto, dict) or not isinstance(name, str):
        return holder
    where = f"{source}: auto: disturbance_spectrum: {name}"
    if read is None:
        raise SpecError(f"{where}: a spec given as text alone cannot name files")
    try:
        text = read(name).decode("utf-8")
    except (InputError, UnicodeDecodeError) as problem:
        raise SpecError(f"{where}: {problem}") from None
    lines = [line.replace(",", " ").split() for line in text.splitlines() if line.strip()]
    if lines and not _are_numbers(lines[0]):
        lines = lines[1:]
    for line in lines:
        if len(line) != 2 or not _are_numbers(line):
            raise SpecError(f"{where}: expected two numbers in a line, Hz and power, got {' '.join(line)[:40]!r}")
    hz, power = ([float(line[column]) for line in lines] for column in (0, 1))
    return holder | {"auto": auto | {"disturbance_spectrum": {"hz": hz, "power": power}}}


def _are_numbers(words: list[str]) -> bool:
    try:
        return all(np.isfinite([float(word) for word in words]))
    except ValueError:
        return False
