"""Log lines for streams that may stop taking any."""

import contextlib
import os
import re
import select
import signal
import socket
import time

import pytest

from dob_companion.view.lines import Lines, event_line

MANY = 40_000
"""Lines of a hundred bytes: more than a pipe, a terminal or a socket takes."""


@contextlib.contextmanager
def pipe():
    reading, writing = os.pipe()
    yield reading, writing
    os.close(reading)


@contextlib.contextmanager
def terminal():
    master, slave = os.openpty()
    yield master, slave
    os.close(master)


@contextlib.contextmanager
def journal():
    """As systemd gives it to a service: a stream socket."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
    with ours:
        yield ours.fileno(), theirs.detach()


def read_all(fd):
    kept = b""
    while select.select([fd], [], [], 0.2)[0]:
        kept += os.read(fd, 1 << 20)
    return kept.decode().replace("\r", "")


@pytest.mark.parametrize("kind", [pipe, terminal, journal])
def test_a_log_that_nobody_reads_loses_whole_lines_and_says_how_many(kind):
    with kind() as (reading, writing), os.fdopen(writing, "w") as stream:
        lines = Lines(stream)
        assert os.get_blocking(writing), "which is shared with others"
        for k in range(MANY):  # it returns
            lines.write(f"line {k} " + 80 * "x")
        text = read_all(reading)
        lines.write("the last")
        text += read_all(reading)
        lines.close()
    *rows, last = text.splitlines()
    number = 0
    for row in rows:
        if left_out := re.fullmatch(r"\((\d+) lines left out\)", row):
            number += int(left_out[1])
        else:
            assert row == f"line {number} " + 80 * "x"
            number += 1
    assert number == MANY
    assert last == "the last"
    assert 0 < lines.left_out < MANY


def test_lines_for_a_reader_that_has_gone_are_counted():
    reading, writing = os.pipe()
    with os.fdopen(writing, "w") as stream:
        lines = Lines(stream)
        lines.write("taken")
        os.close(reading)
        for _ in range(5):
            lines.write("lost")
        lines.close()
    assert lines.left_out == 5


def test_a_terminal_that_was_closed_takes_nothing_and_ends_nothing():
    with terminal() as (master, slave), os.fdopen(slave, "w") as stream:
        lines = Lines(stream)
        lines.write("taken")
        os.dup2(os.open(os.devnull, os.O_RDWR), master)  # closes it
        lines.write("lost")
        lines.close()
        assert lines.left_out == 1
        with contextlib.suppress(OSError):
            stream.close()


def test_a_file_on_a_disk_that_stands_still_holds_nothing_up_and_has_all_lines_in_the_end(tmp_path):
    path = tmp_path / "log"
    with path.open("w") as stream:
        lines = Lines(stream)
        waiting = lines._outlet._process.pid
        os.kill(waiting, signal.SIGSTOP)
        for k in range(MANY):  # it returns
            lines.write(f"line {k} " + 80 * "x")
        assert lines.left_out > 0
        os.kill(waiting, signal.SIGCONT)
        kept = MANY - lines.left_out
        while f"({MANY - kept} lines left out)\n" not in path.read_text():  # told when there is room again
            lines.write("again")
            time.sleep(0.02)
        lines.close()
    assert path.read_text().startswith("".join(f"line {k} " + 80 * "x" + "\n" for k in range(kept)))


def test_two_programs_on_one_file_write_behind_each_other(tmp_path):
    with (tmp_path / "log").open("w") as stream:
        lines = Lines(stream)
        lines.write("first")
        lines.close()
        stream.write("second\n")
    assert (tmp_path / "log").read_text() == "first\nsecond\n"


def test_a_character_that_the_stream_lacks_is_an_escape():
    with pipe() as (reading, writing), os.fdopen(writing, "w", encoding="ascii") as stream:
        lines = Lines(stream)
        lines.write("tcp:höst:5760")
        lines.close()
        assert read_all(reading) == "tcp:h\\xf6st:5760\n"


def test_an_event_is_a_time_a_severity_and_words():
    assert event_line(0.0, "WARNING", "words").endswith(" warning  words")
