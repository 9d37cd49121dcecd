"""Results stand whole or not at all, and a file of another kind is told from its first bytes."""

import gzip
import os

import numpy as np
import pytest

from dob_companion.errors import InputError
from dob_companion.files import require_place, write_bytes, write_files
from dob_companion.files.kinds import TRACE, kind_of, require_trace


def test_all_files_are_written_and_nothing_else_is_left(tmp_path):
    write_files(tmp_path / "new" / "out", {"a.json": "é", "figures/b.svg": b"b"})
    assert sorted(path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()) == [
        "new/out/a.json",
        "new/out/figures/b.svg",
    ]
    assert (tmp_path / "new/out/a.json").read_text(encoding="utf-8") == "é"


def test_one_file_that_cannot_be_written_leaves_everything_as_it_was(tmp_path):
    (tmp_path / "a.json").write_text("old")
    (tmp_path / "report.html").mkdir()
    with pytest.raises(InputError, match=r"report\.html: cannot be written: it is a directory"):
        write_files(tmp_path, {"a.json": "new", "figures/b.svg": "b", "report.html": "page"})
    assert (tmp_path / "a.json").read_text() == "old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.json", "report.html"]


def test_a_full_disk_leaves_no_folder_behind(tmp_path, monkeypatch):
    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match="No space left"):
        write_files(tmp_path / "out", {"a.json": "new", "figures/b.svg": "b"})
    assert list(tmp_path.iterdir()) == []


def test_a_file_named_as_a_folder_is_one_error(tmp_path):
    with pytest.raises(InputError, match=r"cannot be written"):
        write_bytes(tmp_path, b"x")
    file = tmp_path / "file"
    file.write_bytes(b"")
    for place in (file, file / "inside"):
        with pytest.raises(InputError, match=r"file is not a directory"):
            require_place(place)
    require_place(tmp_path / "not" / "there" / "yet")


@pytest.mark.parametrize(
    ("start", "kind"),
    [
        (gzip.compress(b"x"), TRACE),
        (b"\x00\x06\x10\x11\x12\x13\x14\x15\xfd\x09", "a telemetry log"),
        (b"ULog\x01\x12\x35\x01", "a PX4 log"),
        (b"\xa3\x95\x80\x80", "an ArduPilot log"),
        (b"", "an empty file"),
        (b'{"schema": ', ""),
    ],
    ids=["trace", "tlog", "ulog", "bin", "empty", "json"],
)
def test_a_file_is_told_by_its_first_bytes(start, kind, tmp_path):
    path = tmp_path / "x.dobtrace"
    path.write_bytes(start)
    assert kind_of(path) == kind
    if kind != TRACE:
        with pytest.raises(InputError, match=kind or "not a recorded flight"):
            require_trace(path)


def test_a_telemetry_log_names_the_flight_beside_it(tmp_path):
    log = tmp_path / "flight-0001-000.tlog"
    log.write_bytes(b"\x00\x06\x10\x11\x12\x13\x14\x15\xfe\x09" + np.random.default_rng(1).bytes(100))
    log.with_suffix(".dobtrace").write_bytes(b"")
    with pytest.raises(InputError, match=r"000\.tlog: a telemetry log, .*flight-0001-000\.dobtrace lies beside it"):
        require_trace(log)
