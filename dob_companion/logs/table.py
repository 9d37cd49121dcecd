"""Tables: CSV with a line of names, or an .npz of arrays under the same names (docs/interfaces.md, Logs).

::

    time_s                                   s, rising                                required
    roll_rate,    pitch_rate,    yaw_rate    rad/s                                    required
    roll_moment,  pitch_moment,  yaw_moment  normalized torque, applied from time_s   required
    roll_injected, …                         what of the moment was added to excite
    roll_rate_setpoint, …                    rad/s
    roll_setpoint, …                         attitude asked for, rad
    roll, pitch, yaw                         attitude, rad
    thrust                                   0…1
    armed, flying, saturated                 0 or 1

Hover axes. Semicolons or tabs may stand between cells, and then a comma in a number. A cell may be empty, in an .npz
NaN, where a signal has no sample at that time.
"""

import csv
import io
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from dob_companion.errors import LogError, unknown_key
from dob_companion.files import read_bytes
from dob_companion.identification.record import Floats, Record
from dob_companion.logs.found import FACTS, Found, records
from dob_companion.logs.series import Series

TIME = "time_s"
_AXES = ("roll", "pitch", "yaw")
_REQUIRED = {"rates": "{}_rate", "moment": "{}_moment"}
_OPTIONAL = {
    "injected": "{}_injected",
    "rate_setpoint": "{}_rate_setpoint",
    "attitude_setpoint": "{}_setpoint",
    "attitude": "{}",
}
_COLUMNS = {name: [form.format(axis) for axis in _AXES] for name, form in (_REQUIRED | _OPTIONAL).items()}
_NAME = re.compile(r"[a-z_][\w. \[\]/()%°²-]*")
_TELLING, _LONGEST_STEP_S = 16, 1.0
"""Lines that tell the usual step of time, and one that no record of an aircraft has."""
_NAMES = [TIME, *(column for columns in _COLUMNS.values() for column in columns), "thrust", *FACTS]


def looks_like_csv(begin: bytes) -> bool:
    """Whether these first bytes may be a table's: a line of names between commas, semicolons or tabs."""
    names = _names(next(_lines(_decoded(begin)), ""))[0]
    return TIME in names or (len(names) > len(_AXES) and all(_NAME.fullmatch(name) for name in names))


def read_csv(path: Path) -> tuple[Record, ...]:
    """A CSV table. Raises LogError, one line that names line and column."""
    text = _decoded(read_bytes(path)).replace("\0", "\ufffd")
    between = _names(next(_lines(text), ""))[1]
    if between != ",":  # as where numbers have a comma
        text = text.replace(",", ".")
    rows = csv.reader(io.StringIO(text, newline=""), delimiter=between)
    try:
        names, table, cut = _rows(rows, str(path))
    except csv.Error as problem:
        raise LogError(f"{path}: line {rows.line_num}: {problem}") from None
    columns = dict(zip(names, np.array(table, dtype=np.float64).reshape(-1, len(names)).T, strict=True))
    return _records(columns, str(path), ("the last line is cut short: left out",) if cut else ())


def _decoded(data: bytes) -> str:
    wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    return data.decode("utf-16" if wide else "utf-8-sig", "replace")


def _lines(text: str) -> Iterator[str]:
    """Those that are no comment."""
    return (line for line in io.StringIO(text, newline=None) if line.strip()[:1] not in ("", "#"))


def _names(line: str) -> tuple[list[str], str]:
    """The names in the first line, and what stands between them."""
    between = max(",;\t", key=line.count)
    return [name.strip().strip('"').lower() for name in line.split(between)], between


def _rows(rows: Any, source: str) -> tuple[list[str], list[list[float]], bool]:
    """Names, numbers, and whether the last line was not whole."""
    names: list[str] = []
    table: list[list[float]] = []
    problem = ""
    for row in rows:
        if not row or row[0].lstrip().startswith("#"):
            continue
        if problem:
            raise LogError(problem)
        if not names:
            names = [name.strip().lower() for name in row]
            if twice := next((name for name in names if names.count(name) > 1), ""):
                raise LogError(f"{source}: the column {twice} stands in it twice, expected each once")
            continue
        try:
            if len(row) != len(names):
                raise LogError(f"has {len(row)} cells, expected {len(names)} as in the line of names")
            table.append([_number(cell, name) for cell, name in zip(row, names, strict=True)])
        except LogError as wrong:  # the file's last line may have been cut off
            problem = f"{source}: line {rows.line_num}: {wrong}"
    return names, table, bool(problem)


def _number(cell: str, name: str) -> float:
    """NaN where there is no sample; what was written as not a number is one, and counted as lost further on."""
    if not cell.strip():
        return np.nan
    try:
        number = float(cell)
        return np.inf if np.isnan(number) else number
    except ValueError:
        raise LogError(f"{name} is {cell.strip()[:40]!r}, expected a number") from None


def read_npz(path: Path) -> tuple[Record, ...]:
    """Arrays of numbers, one for each column. Raises LogError, one line."""
    columns: dict[str, Floats] = {}
    try:
        with np.load(io.BytesIO(read_bytes(path)), allow_pickle=False) as arrays:
            for name in arrays.files:
                columns[name] = np.asarray(arrays[name], dtype=np.float64)
    except (OSError, ValueError, TypeError, EOFError, KeyError, zipfile.BadZipFile, NotImplementedError) as problem:
        within = _within(path)
        inside = f"; it holds {within}: unpack it first" if within else ""
        words = str(problem).splitlines()[0][:60] if str(problem) else type(problem).__name__
        raise LogError(f"{path}: not a whole .npz of numbers: {words}{inside}") from None
    for name, column in columns.items():
        expected = columns.get(TIME, column).shape
        if column.ndim != 1 or column.shape != expected:
            raise LogError(f"{path}: {name} has shape {column.shape}, expected {expected}, one value for each {TIME}")
    return _records(columns, str(path), ())


def _within(path: Path) -> str:
    """The first file in an archive that is no array's; "" where there is none."""
    try:
        with zipfile.ZipFile(path) as archive:
            return next((name for name in archive.namelist() if not name.endswith(".npy")), "")
    except (OSError, ValueError, zipfile.BadZipFile, NotImplementedError):
        return ""


def _records(columns: dict[str, Floats], source: str, remarks: tuple[str, ...]) -> tuple[Record, ...]:
    missing = [name for name in [TIME, *_COLUMNS["rates"], *_COLUMNS["moment"]] if name not in columns]
    if missing:
        raise LogError(f"{source}: lacks the column {', '.join(missing)}; body rates in rad/s, normalized torque")
    if unlike := _unlike_seconds(columns[TIME]):
        raise LogError(f"{source}: {TIME} {unlike}")
    said = [f"column left out: {unknown_key(name, _NAMES)}" for name in columns if name not in _NAMES]
    for signal, wanted in _COLUMNS.items():
        present = [name in columns for name in wanted]
        if any(present) and not all(present):
            raise LogError(f"{source}: lacks the column {wanted[present.index(False)]}: {signal} needs all three axes")
    others = {name: _series(columns, _COLUMNS[name]) for name in _OPTIONAL if _COLUMNS[name][0] in columns}
    if "thrust" in columns:
        others["thrust"] = _series(columns, ["thrust"])
    rates, moment = _series(columns, _COLUMNS["rates"]), _series(columns, _COLUMNS["moment"])
    return records(
        Found(
            source=source,
            rates=rates,
            moment=moment,
            others=others,
            facts={name: _series(columns, [name]) for name in FACTS if name in columns},
            remarks=(*remarks, *said),
        )
    )


def _unlike_seconds(time: Floats) -> str:
    """Why these cannot be times of samples in seconds; "" where they can."""
    steps = np.diff(time[np.isfinite(time)])
    if len(steps) < _TELLING:
        return ""
    usual = float(np.median(np.abs(steps)))
    if usual == 0.0:
        return "does not go on from line to line: expected seconds with enough digits"
    if usual > _LONGEST_STEP_S:
        return f"goes on by {usual:.4g} from line to line: expected seconds, not ms or µs"
    return ""


def _series(columns: dict[str, Floats], names: list[str]) -> Series:
    """The rows in which at least one of these has a value."""
    values = np.column_stack([columns[name] for name in names])
    there = ~np.isnan(values).all(axis=1)
    return Series.of(np.flatnonzero(there), columns[TIME][there], values[there])
