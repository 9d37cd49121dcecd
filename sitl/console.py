"""Standard output and error of a program: what cannot be written must not decide what becomes of a flight.

Notes on standard error are written if they can be, and not waited for, since a clock would stand meanwhile. A result
that nobody reads any more, as in `… | head`, is no error, and the program ends with its own exit code. One that could
not be written, as on a full disk, is said in one line, and success becomes exit code 1.
"""

import errno
import functools
import io
import os
import select
import sys
from collections.abc import Callable
from typing import Any, ParamSpec, TextIO

EXIT_UNWRITTEN = 1

P = ParamSpec("P")


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
    """Whole lines that nobody waits for: those that are not taken are counted, and that is said later."""

    left_out = 0

    def write(self, data: Any, /) -> int:
        """Write a line, if there is room for one."""
        if not select.select([], [self], [], 0.0)[1]:
            self.left_out += 1
            return memoryview(data).nbytes
        if self.left_out:
            told, self.left_out = f"({self.left_out} lines left out)\n", 0
            super().write(told.encode())
        return super().write(data)


def program(name: str) -> Callable[[Callable[P, int]], Callable[P, int]]:
    """A `main` whose outputs hold and whose exit code is right, whatever becomes of them.

    Streams that somebody has put in the place of standard output and error, as a test does, stay as they are.
    """

    def holding(main: Callable[P, int]) -> Callable[P, int]:
        @functools.wraps(main)
        def run(*args: P.args, **kwargs: P.kwargs) -> int:
            _open_standard_descriptors()
            before, results = (sys.stdout, sys.stderr), Results(1, "w", closefd=False)
            if sys.stdout is sys.__stdout__:
                sys.stdout = _text(results, sys.stdout)
            if sys.stderr is sys.__stderr__:
                sys.stderr = _text(Notes(2, "w", closefd=False), sys.stderr)
            try:
                return _verdict(name, results, _code(name, lambda: main(*args, **kwargs)))
            except SystemExit as leaving:  # of argparse, after help or usage; of a signal
                code = leaving.code if isinstance(leaving.code, int) else 0
                raise SystemExit(_verdict(name, results, code)) from None
            finally:
                sys.stdout.flush()
                sys.stdout, sys.stderr = before

        return run

    return holding


def _code(name: str, main: Callable[[], int]) -> int:
    try:
        return main()
    except OSError as problem:  # a disk that is full or gone in the middle of the work
        where = f"{problem.filename}: " if problem.filename else ""
        print(f"{name}: {where}{problem.strerror or problem}", file=sys.stderr, flush=True)
        return 1


def _verdict(name: str, results: Results, code: int) -> int:
    sys.stdout.flush()
    if results.trouble is None or results.trouble.errno == errno.EPIPE:
        return code
    print(f"{name}: standard output cannot be written: {results.trouble.strerror}", file=sys.stderr, flush=True)
    return code or EXIT_UNWRITTEN


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
    """Where one was closed, as by `2>&-`, the next socket to be opened would take its place and get its lines."""
    while (fd := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(fd, True)
    os.close(fd)
