"""Rows on disk: Parquet parts as they come in, one file at the end. Every file is written whole or not at all.

A campaign's directory holds

    campaign.json, scenario/, designs/    what is flown: enough to fly any flight again
    parts/NNNNNN.parquet                  rows that have come in so far
    flights.parquet                       all rows by number, when the last has come in; the parts are gone then
    index.html                            the page
"""

import os
import shutil
from collections.abc import Iterable
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from sitl.campaign.pilot import MEASURES, Row
from sitl.constants import AXES
from sitl.errors import InputError

MOST_PARTS = 64
"""So many parts are joined into one, that a long campaign does not drown its directory in files."""

SCHEMA = pa.schema(
    [
        ("flight", pa.int64()),
        ("seed", pa.int64()),
        ("airframe", pa.string()),
        ("design", pa.string()),
        ("delay", pa.int32()),
        ("gain", pa.float64()),
        ("pole", pa.float64()),
        ("wind_m_s", pa.float64()),
        ("outcome", pa.string()),
        ("reason", pa.string()),
        ("state", pa.string()),
        ("flown_s", pa.float64()),
        ("delay_samples", pa.int32()),
        ("injecting", pa.float64()),
        ("checks", pa.int32()),
        ("checks_missed", pa.int32()),
        ("missed", pa.string()),
        *((f"{name}_{axis}", pa.float64()) for axis in AXES for name in (*MEASURES, "max_correction")),
    ]
)
"""One row per flight; docs/campaigns.md says what each column is."""


class Store:
    """The rows of one campaign directory."""

    def __init__(self, directory: Path) -> None:
        self._parts = directory / "parts"
        self._whole = directory / "flights.parquet"
        self._next = 1 + max((int(path.stem) for path in self._files()), default=-1)

    def table(self) -> pa.Table:
        """All rows that are there, by number, each once. Raises InputError for a file that is damaged."""
        files = [self._whole] if self._whole.exists() else self._files()
        table = pa.concat_tables([SCHEMA.empty_table(), *map(_read, files)])
        rows = {row["flight"]: row for row in table.to_pylist()}
        return _table(rows[number] for number in sorted(rows))

    def add(self, rows: list[Row]) -> None:
        """Keep rows that have come in."""
        self._write_part(_table(rows))
        if len(self._files()) > MOST_PARTS:
            self._join()

    def finish(self) -> None:
        """All rows are there: one file, sorted."""
        if not self._whole.exists():
            replace(self._whole, _packed(self.table()))
        shutil.rmtree(self._parts, ignore_errors=True)

    def _join(self) -> None:
        old = self._files()
        self._write_part(self.table())
        for path in old:  # a crash before this leaves rows twice, which `table` does not mind
            path.unlink()

    def _write_part(self, table: pa.Table) -> None:
        self._parts.mkdir(exist_ok=True)
        replace(self._parts / f"{self._next:06}.parquet", _packed(table))
        self._next += 1

    def _files(self) -> list[Path]:
        return sorted(self._parts.glob("[0-9]*.parquet"))


def replace(path: Path, content: bytes) -> None:
    """Write beside, flush to the disk and rename: a reader, or a crash, never sees half a file."""
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    with beside.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    beside.replace(path)


def _table(rows: Iterable[Row]) -> pa.Table:
    return pa.Table.from_pylist(list(rows), schema=SCHEMA)


def _packed(table: pa.Table) -> bytes:
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd")
    return sink.getvalue().to_pybytes()  # type: ignore[no-any-return]


def _read(path: Path) -> pa.Table:
    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowInvalid) as error:
        raise InputError(f"{path}: cannot be read as Parquet: {error}") from None
    if table.schema != SCHEMA:
        raise InputError(f"{path}: columns are not this version's; expected a directory that this version began")
    return table
