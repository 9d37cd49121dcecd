"""Standard output and error of a command: what cannot be written must not decide what becomes of the work.

Notes on standard error are written if they can be. A result that nobody reads any more, as in `… | head`, is no error
and the command ends with its own exit code. One that could not be written, as on a full disk, is said in one line, and
success becomes exit code 1.
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


class Patient(io.FileIO):
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


@contextlib.contextmanager
def console() -> Iterator[Callable[[int], int]]:
    """Give the process outputs that hold. Yields what makes the right exit code of a command's own.

    Streams that somebody has put in the place of standard output and error, as a test does, stay as they are.
    """
    _open_standard_descriptors()
    out, err = sys.stdout, sys.stderr
    replaced = [(name, fd) for name, fd in (("stdout", 1), ("stderr", 2)) if _is_original(name)]
    files = {name: Patient(fd, "w", closefd=False) for name, fd in replaced}
    for name, _ in replaced:
        setattr(sys, name, _text(files[name], getattr(sys, name)))

    def verdict(code: int) -> int:
        with contextlib.suppress(OSError):
            sys.stdout.flush()
        trouble = files["stdout"].trouble if "stdout" in files else None
        if trouble is None or trouble.errno == errno.EPIPE:
            return code
        complain(f"standard output cannot be written: {trouble.strerror}")
        return code or EXIT_UNWRITTEN

    try:
        yield verdict
    finally:
        for name, _ in replaced:
            getattr(sys, name).flush()
        sys.stdout, sys.stderr = out, err


def complain(text: str) -> None:
    """One line on standard error, unless nobody takes what stands there already."""
    if _takes_more(sys.stderr):
        print(f"dob-companion: {' '.join(text.split())}", file=sys.stderr, flush=True)


def _takes_more(stream: TextIO) -> bool:
    try:
        return bool(select.select([], [stream], [], PATIENCE_S)[1])
    except io.UnsupportedOperation:  # no descriptor of the system's: memory
        return True


def _is_original(name: str) -> bool:
    return getattr(sys, name) is getattr(sys, f"__{name}__")


def _text(raw: Patient, before: TextIO | None) -> TextIO:
    """As the interpreter makes them, except that a character which the encoding lacks is written as an escape."""
    return io.TextIOWrapper(
        io.BufferedWriter(raw),
        getattr(before, "encoding", "utf-8"),
        "backslashreplace",
        line_buffering=raw.isatty() or raw.fileno() == 2,
        write_through=getattr(before, "write_through", False),
    )


def _open_standard_descriptors() -> None:
    """Where one was closed, as by `2>&-`, the next file or socket to be opened would take its place and its output."""
    while (fd := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(fd, True)
    os.close(fd)
