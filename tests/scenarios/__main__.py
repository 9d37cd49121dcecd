"""Every scenario at every link delay over the wire: `python -m tests.scenarios [-o DIR] [--write] [SCENARIO …]`.

It prints the tables of docs/scenario-results.md (`--write` puts them there) and returns 1 when a check has failed.
"""

import argparse
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

from sitl.scenario.spec import load, packaged_names
from tests.scenarios.designs import design_file
from tests.scenarios.page import PAGE, page
from tests.scenarios.wire import Flown, fly

DELAYS = (1, 2, 3)


def compared() -> list[str]:
    """Packaged scenarios with two windows."""
    return [name for name in packaged_names() if load(name).windows]


def fly_all(names: list[str], directory: Path, seed: int, workers: int) -> list[Flown]:
    """All flights, in order; each in a directory of its own, NAME-DELAY."""
    designs = {delay: design_file(directory, delay) for delay in DELAYS}

    def one(job: tuple[str, int]) -> Flown:
        name, delay = job
        flown = fly(name, designs[delay], delay, directory / f"{name}-{delay}", seed)
        print(f"{name} at {delay}: exit code {flown.code}; {flown.last_words}", file=sys.stderr, flush=True)
        return flown

    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(one, product(names, DELAYS)))


def main() -> int:
    """Fly, print, and say whether all checks held."""
    parser = argparse.ArgumentParser(prog="python -m tests.scenarios", description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="SCENARIO", help="default: all")
    parser.add_argument("-o", dest="directory", type=Path, metavar="DIR", help="keep results and figures here")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2, help="flights at a time (%(default)s)")
    parser.add_argument("--write", action="store_true", help=f"into {PAGE.name}")
    options = parser.parse_args()
    with TemporaryDirectory() as temporary:
        directory = options.directory or Path(temporary)
        directory.mkdir(parents=True, exist_ok=True)
        flights = fly_all(options.names or compared(), directory, options.seed, options.workers)
    text = page(flights, options.seed)
    print(text)
    if options.write:
        PAGE.write_text(text, "utf-8")
    return int(any(flown.code for flown in flights))


if __name__ == "__main__":
    sys.exit(main())
