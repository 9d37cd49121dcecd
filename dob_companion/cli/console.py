"""Standard output and error of a command: what cannot be written must not decide what becomes of the work.

Notes on standard error are written if they can be, and not waited for: a warning must not hold a flight. A result that
nobody reads any more, as in `… | head`, is no error and the command ends with its own exit code. One that could not be
written, as on a full disk, is said in one line, and success becomes exit code 1.
"""

import contextlib
import errno
import io
import os
import select
import sys
from collections.abc import Callable, Iterator
from typing import Any, TextIO

EXIT_UNWRITTEN = 1

PATIENCE_S = 1.0
"""How long a last line waits for a reader."""


class Results(io.FileIO):
    """A descriptor to which writing never fails: what it does not take is lost, and the first trouble is kept."""

    trouble: OSError | None = None

    def write(self, data: Any, /) -> int:
        """Write, waiting for a reader where the descriptor itself does not."""
        try:
            while (written := super().write(data)) is None:  # O_NONBLOCK, set by whoever started us
                select.select([], [self], [])
        except OSError as problem:
            self.trouble = self.trouble or problem
            return memoryview(data).nbytes
        return written


class Notes(Results):
    """Whole lines that nobody waits for; those that are not taken are lost."""

    def write(self, data: Any, /) -> int:
        """Write a line, if there is room for one."""
        return super().write(data) if select.select([], [self], [], 0.0)[1] else memoryview(data).nbytes


@contextlib.contextmanager
def console() -> Iterator[Callable[[int], int]]:
    """Give the process outputs that hold. Yields what makes the right exit code of a command's own.

    Streams that somebody has put in the place of standard output and error, as a test does, stay as they are.
    """
    _open_standard_descriptors()
    out, err = sys.stdout, sys.stderr
    results = Results(1, "w", closefd=False)
    if out is sys.__stdout__:
        sys.stdout = _text(results, out)
    if err is sys.__stderr__:
        sys.stderr = _text(Notes(2, "w", closefd=False), err)

    def verdict(code: int) -> int:
        sys.stdout.flush()
        if results.trouble is None or results.trouble.errno == errno.EPIPE:
            return code
        complain(f"standard output cannot be written: {results.trouble.strerror}")
        return code or EXIT_UNWRITTEN

    try:
        yield verdict
    finally:
        sys.stdout.flush()
        sys.stdout, sys.stderr = out, err


def complain(text: str) -> None:
    """One line on standard error, unless nobody takes what stands there already."""
    if _takes_more(sys.stderr):
        print(f"dob-companion: {' '.join(text.split())}", file=sys.stderr, flush=True)


def progress(text: str) -> None:
    """What is at work, on one line of a terminal that the next replaces ("" clears it); nothing in a pipe."""
    if sys.stderr.isatty():
        print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)


def _takes_more(stream: TextIO) -> bool:
    try:
        return bool(select.select([], [stream], [], PATIENCE_S)[1])
    except io.UnsupportedOperation:  # no descriptor of the system's: memory
        return True


def _text(raw: Results, before: TextIO | None) -> TextIO:
    """As the interpreter makes them, except that a character which the encoding lacks is written as an escape."""
    return io.TextIOWrapper(
        io.BufferedWriter(raw),
        getattr(before, "encoding", "utf-8"),
        "backslashreplace",
        line_buffering=raw.isatty() or isinstance(raw, Notes),
        write_through=getattr(before, "write_through", False),
    )


def _open_standard_descriptors() -> None:
    """Where one was closed, as by `2>&-`, the next file or socket to be opened would take its place and its output."""
    while (fd := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(fd, True)
    os.close(fd)
