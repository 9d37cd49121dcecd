"""Command line of campaigns: fly them, and fly one of their flights again."""

import argparse
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from sitl.campaign import fleet
from sitl.campaign.keys import read
from sitl.campaign.pilot import Row, fly, row_of
from sitl.campaign.progress import Progress
from sitl.console import program
from sitl.errors import InputError, SitlError
from sitl.extras import remedy
from sitl.result import write
from sitl.scenario.spec import AIRFRAMES

if TYPE_CHECKING:
    from sitl.campaign.directory import Directory

_EXAMPLE = """\
examples:
  dob-companion design examples/tailsitter_paper.toml -o design
  python -m sitl.campaign --designs design/design.json --seeds 200 --gain 0.7..1.3 --delays 1,2 -o campaign
  python -m sitl.campaign replay campaign --flight 17 -o flight-17

The same command again goes on where it was stopped. With a cluster:
  dask scheduler --host 127.0.0.1 &  dask worker tcp://127.0.0.1:8786 --nthreads 1 --nworkers 8 &
  python -m sitl.campaign campaign.toml --scheduler tcp://127.0.0.1:8786 -o campaign
"""

_OF_THE_EXTRA = ("pyarrow", "dask", "distributed", "matplotlib", "jinja2", "markupsafe")


def parser() -> argparse.ArgumentParser:
    """The parser of a campaign's own command, also the source of `--help`."""
    p = argparse.ArgumentParser(
        prog="python -m sitl.campaign",
        description="Many simulated flights: over seeds, plants, delays, designs; resumable; on one computer or many.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = p.add_argument
    add("file", nargs="?", type=Path, metavar="CAMPAIGN.toml", help="what to fly; options win over it")
    add("-o", dest="directory", type=Path, required=True, metavar="DIR", help="rows and page; begun campaigns go on")
    add("--scenario", metavar="NAME", help="a scenario with windows, or a .toml file (paper)")
    add("--designs", type=_words, metavar="[NAME=]FILE,…", help="design.json files")
    add("--seeds", type=int, metavar="N", help="how many (100)")
    add("--first-seed", type=int, metavar="N", help="and from which on (1)")
    add("--airframes", type=_words, metavar="NAME,…", help=f"of {', '.join(AIRFRAMES)} (the scenario's)")
    add("--delays", type=_numbers, metavar="N,…", help="ages of a correction when it acts, samples; 0: no link (1)")
    add("--gain", type=_values, metavar="X,… or A..B", help="factors on the plant's gain; A..B draws one a seed (1)")
    add("--pole", type=_values, metavar="X,… or A..B", help="likewise, on the corner frequency of its lag (1)")
    add("--wind-m-s", type=_values, metavar="X,… or A..B", help="mean wind with its turbulence (the scenario's)")
    add("--parameters", type=_settings, metavar="NAME=X,…", help="the companion's, such as DOB_LIMIT=0.2")
    add("--processes", type=_positive, default=os.cpu_count(), metavar="N", help="on this computer (%(default)s)")
    add("--scheduler", metavar="ADDRESS", help="of a Dask cluster, to fly there instead")
    add("--json", action="store_true", help="print the summary as JSON")
    return p


def replay_parser() -> argparse.ArgumentParser:
    """The parser of `replay`."""
    p = argparse.ArgumentParser(
        prog="python -m sitl.campaign replay",
        description="Fly one flight of a campaign again, from its seed, and keep its record.",
        epilog="example: python -m sitl.campaign replay campaign --flight 17 -o flight-17",
    )
    p.add_argument("campaign", type=Path, metavar="DIR", help="the campaign's directory")
    p.add_argument("--flight", type=int, required=True, metavar="N", help="number of the flight, from 0")
    p.add_argument(
        "-o",
        dest="directory",
        type=Path,
        required=True,
        metavar="OUT",
        help="result.json, flight.npz, figure.png go here",
    )
    p.add_argument("--json", action="store_true", help="print the row as JSON")
    return p


@program("campaign")
def main(arguments: list[str] | None = None) -> int:
    """Run; returns the exit code."""
    given = sys.argv[1:] if arguments is None else arguments
    try:
        if given and given[0] == "replay":
            return _replay(replay_parser().parse_args(given[1:]))
        return _campaign(parser().parse_args(given))
    except SitlError as error:
        _say(str(error))
        return error.exit_code
    except ModuleNotFoundError as missing:
        if (missing.name or "").partition(".")[0] not in _OF_THE_EXTRA:
            raise
        _say(remedy(missing, "campaign"))
        return InputError.exit_code
    except KeyboardInterrupt:
        _say("interrupted; the same command goes on from here")
        return 130


def _campaign(options: argparse.Namespace) -> int:
    from sitl.campaign.directory import begun  # pyarrow: not for --help
    from sitl.campaign.summary import summarize, table

    campaign = read(options.file, vars(options))
    with begun(options.directory, campaign) as directory:
        _fly(directory, options)
        rows = directory.store.table().to_pylist()
        from sitl.campaign.page import write_page  # matplotlib takes its time

        write_page(directory, rows)
    summary = summarize(directory, rows)
    print(json.dumps(summary, indent=2) if options.json else table(summary))
    _say(f"{options.directory / 'index.html'}")
    failed, missed = summary["failed"], summary["missed"]
    if failed or missed:
        _say(f"of {summary['flights']} flights {failed} did not reach their end and {missed} missed a check")
    return 1 if failed or missed else 0


def _fly(directory: "Directory", options: argparse.Namespace) -> None:
    store, flights = directory.store, directory.flights
    done = set(store.table()["flight"].to_pylist())
    left = [inputs for inputs in flights if inputs.flight not in done]
    if done:
        _say(f"{len(done)} of {len(flights)} flights are there already")
    began, flown_s, progress = monotonic(), 0.0, Progress(len(flights), len(done))
    try:
        for rows in _rows(directory, left, options, progress):
            store.add(rows)
            progress.add(len(rows))
            flown_s += sum(row["flown_s"] for row in rows)
    finally:
        progress.clear()
    store.finish()
    if left:
        took = monotonic() - began
        _say(f"{len(left)} flights in {took:.1f} s: {len(left) / took:.2f} a second, {flown_s / took:.0f} x real time")


def _rows(
    directory: "Directory", left: list[Any], options: argparse.Namespace, progress: Progress
) -> Iterator[list[Row]]:
    jobs = map(directory.job, left)
    if not options.scheduler:
        return fleet.local(jobs, options.processes)
    from sitl.campaign.cluster import cluster

    def say(text: str) -> None:
        progress.clear()
        _say(text)

    return cluster(jobs, options.scheduler, say)


def _replay(options: argparse.Namespace) -> int:
    from sitl.campaign.directory import opened

    directory = opened(options.campaign)
    if not 0 <= options.flight < len(directory.flights):
        raise InputError(f"--flight {options.flight}: expected a number from 0 to {len(directory.flights) - 1}")
    if options.directory.exists() and not options.directory.is_dir():
        raise InputError(f"-o {options.directory}: is a file; expected a directory")
    job = directory.job(directory.flights[options.flight])
    craft = fly(job)
    row = row_of(job, craft)
    write(craft.flight, "in-process", options.directory, drawn=True)
    print(json.dumps(row, indent=2) if options.json else "\n".join(f"{name:22} {row[name]}" for name in row))
    if craft.failure:
        _say(craft.failure)
    return 1 if craft.failure else 0


def _words(text: str) -> list[str]:
    return text.split(",")


def _number(text: str) -> float:
    try:
        return int(text)
    except ValueError:
        return float(text)


def _numbers(text: str) -> list[float]:
    try:
        return [_number(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected numbers with commas between") from None


def _values(text: str) -> list[float] | dict[str, float]:
    low, dots, high = text.partition("..")
    return {"from": _numbers(low)[0], "to": _numbers(high)[0]} if dots else _numbers(text)


def _settings(text: str) -> dict[str, float]:
    pairs = [part.partition("=") for part in text.split(",")]
    return {name: _numbers(value)[0] for name, _, value in pairs}


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a whole number, 1 or more")
    return int(text)


def _say(text: str) -> None:
    print(f"campaign: {text}", file=sys.stderr, flush=True)
