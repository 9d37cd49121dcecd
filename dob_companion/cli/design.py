"""`dob-companion design`: from a spec to a certified design.json."""

import argparse
import contextlib
import json
import os
import textwrap
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dob_companion.artifact import DobDesign, certificate_object, design_table, dumps
from dob_companion.cli.countdown import Countdown
from dob_companion.cli.robustness import robustness_words
from dob_companion.cli.tradeoff import tuning_object, tuning_table
from dob_companion.errors import SpecError
from dob_companion.files import read_text, reader_beside, require_place, write_files

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dob_companion.synthesis.tune.limits import Tuning
    from dob_companion.synthesis.tune.tuning import Each


AN_AXIS_S = 9.0
"""About what `--auto` takes for one axis on one core (docs/tuning.md), to tell how long it has left."""

TUNED = "tuned.toml"
"""The spec with the weights that --auto found, beside the design."""


def add_parser(subparsers: Any) -> None:
    """Add `design` to the command line."""
    parser = subparsers.add_parser(
        "design",
        help="synthesize and certify an observer",
        description="Solve the H-infinity problem of a spec, certify the result, write design.json and report.html.",
        epilog="example: dob-companion design examples/tailsitter_paper.toml -o my-design",
    )
    parser.add_argument("spec", type=Path, metavar="SPEC.toml", help="the design spec")
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help="where the results go")
    parser.add_argument(
        "--auto",
        action="store_true",
        help="find the weights from the spec's [auto] table; print and draw the trade-off",
    )
    parser.add_argument("--order", type=_states, metavar="N", help="reduce each observer to at most N states")
    parser.add_argument("--json", action="store_true", help="print the certificates as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Design, write, print the certificate."""
    if args.auto and args.order is not None:
        raise SpecError("--order: with --auto, put largest_order = N into the spec's [design] instead")
    design, tunings = design_into(args.out, args.spec, auto=args.auto, order=args.order)
    if args.json:
        print(json.dumps(_objects(design, tunings)))
    else:
        print(certificate_text(design, tunings))
        also = f", {args.out / TUNED}" if args.auto else ""
        print(
            f"\nwritten: {args.out / 'design.json'} (sha256 {design.sha256[:8]}), {args.out / 'report.html'}, figures"
            f"{also}"
        )
    return 0


def design_into(
    folder: Path, path: Path, *, auto: bool, order: int | None = None
) -> "tuple[DobDesign, tuple[Tuning, ...]]":
    """Design what the spec at `path` asks, and write design.json, report.html and figures into `folder`.

    With `auto` tuned.toml as well: the spec with the weights found.

    Raises SpecError, UnsolvableError and NotCertifiedError; then nothing is written.
    """
    from dob_companion.report.design_page import design_report
    from dob_companion.synthesis import design_from_toml
    from dob_companion.synthesis.numeric import numbers_judged
    from dob_companion.synthesis.tune.written import tuned_spec

    require_place(folder)
    created = datetime.now(UTC).isoformat(timespec="seconds")
    spec = read_text(path)
    written = {}
    if auto:
        found, tunings = _tuned(spec, path, created)
        written = {TUNED: tuned_spec(spec, str(path), reader_beside(path), tunings)}
    else:
        found, tunings = design_from_toml(spec, str(path), created, reader_beside(path), largest_order=order), ()
    with numbers_judged(str(path)):
        text, design = dumps(found)
        page, figures = design_report(design, tunings)
    pictures = {f"figures/{name}": picture for name, picture in figures.items()}
    write_files(folder, {"design.json": text, "report.html": page, **written, **pictures})
    return design, tunings


def certificate_text(design: DobDesign, tunings: "tuple[Tuning, ...]") -> str:
    """Tunings, certificates and robustness, as tables."""
    from dob_companion.analysis.attained import attained_words

    reached = "\n".join(textwrap.fill(attained_words(block, design.dt), 80) for block in design.blocks).strip()
    findings = filter(None, (reached, *map(robustness_words, design.blocks)))
    return "\n\n".join([*map(tuning_table, tunings), design_table(design), *findings])


def _tuned(text: str, path: Path, created: str) -> "tuple[DobDesign, tuple[Tuning, ...]]":
    from dob_companion.synthesis.tune.tuning import tuned_design_from_toml

    with Countdown() as countdown, _processes(countdown) as each:
        return tuned_design_from_toml(text, str(path), created, reader_beside(path), countdown.say, each=each)


@contextlib.contextmanager
def _processes(countdown: Countdown) -> "Iterator[Each]":
    """As `map`, by as many processes as the computer has cores; a single task needs none of its own."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of small matrices each process takes one core
    cores = os.cpu_count() or 1
    pool = ProcessPoolExecutor(max_workers=cores, mp_context=get_context("spawn"))

    def each(function: Any, tasks: Any) -> Any:
        work = [AN_AXIS_S * len(task.block.axes) ** 2 for task in tasks]
        countdown.begin(sum(work) / min(cores, len(tasks)))
        found = map(function, tasks) if len(tasks) == 1 else pool.map(function, tasks)
        for count, result in enumerate(found, 1):
            countdown.done(sum(work[:count]) / sum(work))
            yield result

    try:
        yield each
    finally:
        pool.shutdown(cancel_futures=True)


def _objects(design: DobDesign, tunings: "tuple[Tuning, ...]") -> dict[str, Any]:
    """Certificates by block, each with its tuning when there was one."""
    objects = {block.name: certificate_object(block.certificate) for block in design.blocks}
    for tuning in tunings:
        objects[tuning.name]["tuning"] = tuning_object(tuning)
    return objects


def _states(text: str) -> int:
    try:
        order = int(text)
    except ValueError:
        order = 0
    if order < 1:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a whole number of 1 or more")
    return order
