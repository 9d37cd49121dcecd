"""Files broken in every way: a record whose numbers hold, or one line that says why not; never anything else."""

import random

import numpy as np
import pytest

from dob_companion.errors import InputError
from dob_companion.logs import reader_for
from tests.ardupilot.recorded import DATA
from tests.logs import writers

SIGNALS = ("rates", "moment", "injected", "rate_setpoint", "attitude_setpoint", "attitude", "thrust")
FLIGHT = writers.some_flight(seconds=0.5)


def table():
    names = ["time_s", *(f"{axis}_{what}" for what in ("rate", "moment") for axis in ("roll", "pitch", "yaw"))]
    rows = np.column_stack(FLIGHT)
    return "\n".join([",".join(names), *(",".join(map(repr, map(float, row))) for row in rows)]).encode()


def text(tmp_path):
    path = tmp_path / "text.bin"
    path.write_bytes(writers.copter(*FLIGHT).data)
    return writers.as_text(str(path)).encode()


def archive(tmp_path):
    path = tmp_path / "archive.npz"
    names = ["time_s", *(f"{axis}_{what}" for what in ("rate", "moment") for axis in ("roll", "pitch", "yaw"))]
    np.savez(path, **dict(zip(names, np.column_stack(FLIGHT).T, strict=True)))
    return path.read_bytes()


KINDS = {
    "bin": lambda _: writers.copter(*FLIGHT).data,
    "log": text,
    "ulg": lambda _: writers.quad(*FLIGHT).data,
    "tlog": lambda _: (DATA / "copter_hello.tlog").read_bytes()[:60000],
    "csv": lambda _: table(),
    "npz": archive,
}


def holds(path):
    """Number of samples read; 0 where the file was refused. No reader's own exception reaches the last resort."""
    try:
        records = reader_for(path)(path)
    except InputError as problem:
        refused = str(problem)
    else:
        refused = ""
    if refused:
        assert "\n" not in refused
        return 0
    assert records
    for record in records:
        for name in SIGNALS:
            signal = getattr(record, name)
            if signal is not None:
                assert np.isfinite(signal.values).all()
                assert np.isfinite(signal.time).all()
                assert (np.diff(signal.time) > 0.0).all()
                assert len(signal.time) == len(signal.values)
    return sum(len(record.rates.time) for record in records)


@pytest.mark.parametrize("kind", KINDS)
def test_a_log_cut_off_at_every_kilobyte_gives_what_is_whole(tmp_path, kind):
    data, path = KINDS[kind](tmp_path), tmp_path / "x"
    found = []
    for size in [*range(0, len(data), 1024), len(data)]:
        path.write_bytes(data[:size])
        found.append(holds(path))
    assert found[-1] > 0
    assert found == sorted(found)


@pytest.mark.parametrize("kind", KINDS)
def test_a_log_with_bytes_changed_is_read_or_refused(tmp_path, kind):
    data, path, rng = KINDS[kind](tmp_path), tmp_path / "x", random.Random(7)
    for trial in range(60):
        broken = bytearray(data)
        for _ in range(1 + trial % 20):
            at = rng.randrange(len(broken))
            broken[at : at + rng.choice((0, 1, 1, 40))] = rng.randbytes(rng.choice((1, 1, 40)))
        path.write_bytes(bytes(broken))
        holds(path)
