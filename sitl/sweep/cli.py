"""Command line of the frequency sweep."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from sitl.console import program
from sitl.constants import AXES
from sitl.errors import InputError, SitlError
from sitl.extras import remedy
from sitl.sweep.client import SweepClient
from sitl.sweep.flight import given_link, started_vehicle, sweep
from sitl.sweep.multisine import FLEXIBLE, Plan, excitation

_EXAMPLE = """\
example: all three axes of the tail-sitter, results in ./sweep
  python -m sitl.sweep --airframe tailsitter -o sweep
"""

_SCENARIO = """\
# What is swept: a hover in still air.
title = "Frequency sweep in hover"
airframe = "{airframe}"
hover_altitude_m = 5.0
[gyro]
noise_dbw = {noise_dbw}
"""

_FLEXIBLE = """\
[[event]]
kind = "flexible"
"""


def parser() -> argparse.ArgumentParser:
    """The argument parser, also the source of `--help`."""
    plan = Plan()
    p = argparse.ArgumentParser(
        prog="python -m sitl.sweep",
        description="Identify the simulated vehicle's rate dynamics in hover by a frequency sweep over MAVLink.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    p.add_argument("--airframe", choices=("linear", "tailsitter"), default="tailsitter", help="(%(default)s)")
    p.add_argument("--axis", nargs="+", choices=AXES, default=list(AXES), help="default: all three, one after another")
    p.add_argument("--link", metavar="URL", help="sweep the vehicle that waits there, in lockstep, instead")
    p.add_argument("--seed", type=int, default=1, help="of phases and noise (%(default)s)")
    p.add_argument("--rms", type=float, help=f"excitation, normalized torque ({plan.rms}, flexible {FLEXIBLE.rms})")
    p.add_argument("--realizations", type=int, default=plan.realizations, help="of 24.5 s each (%(default)s)")
    p.add_argument("--noise-dbw", type=float, default=-68.0, help="gyro noise (%(default)s)")
    p.add_argument("--band", type=float, nargs=2, metavar="RAD_S", help="fitted (4 to 50)")
    p.add_argument(
        "--flexible", action="store_true", help="with its flexible modes, and more of high frequencies to see them"
    )
    p.add_argument("-o", dest="directory", type=Path, required=True, metavar="DIR", help="where results go")
    return p


@program("sweep")
def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit code, prints one line for anything raised on purpose."""
    options = parser().parse_args(arguments)
    try:
        return _sweep(options)
    except (SitlError, OSError) as error:
        print(f"sweep: {error}", file=sys.stderr)
        return error.exit_code if isinstance(error, SitlError) else 2
    except ModuleNotFoundError as missing:
        if missing.name not in ("scipy", "matplotlib"):
            raise
        print(f"sweep: {remedy(missing, 'design')}", file=sys.stderr)
        return InputError.exit_code
    except KeyboardInterrupt:
        return 130


def _sweep(options: argparse.Namespace) -> int:
    from sitl.sweep.figure import save_figure  # scipy and matplotlib: not for --help
    from sitl.sweep.fit import BAND
    from sitl.sweep.identify import identify, modes, table, write

    directory: Path = options.directory
    directory.mkdir(parents=True, exist_ok=True)
    plan = replace(FLEXIBLE if options.flexible else Plan(), realizations=options.realizations)
    if options.rms is not None:
        plan = replace(plan, rms=options.rms)
    client = SweepClient([(AXES.index(axis), excitation(plan, options.seed)) for axis in options.axis])
    if options.link:
        vehicle = given_link(options.link)
    else:
        scenario = directory / "scenario.toml"
        text = _SCENARIO.format(airframe=options.airframe, noise_dbw=options.noise_dbw)
        scenario.write_text(text + _FLEXIBLE if options.flexible else text, "utf-8")
        vehicle = started_vehicle(scenario, options.seed)
    with vehicle as (link, ended):
        sweep(client, link, ended)
    band = (options.band[0], options.band[1]) if options.band else BAND
    found = [identify(axis, plan, record, band) for axis, record in zip(options.axis, client.records, strict=True)]
    write(found, client.records, directory)
    for one in found:
        save_figure(one, directory / f"{one.axis}.png")
    print(table(found))
    for one in found:
        for frequency, height in modes(one):
            print(f"{one.axis}: a mode at {frequency:.0f} rad/s, {height:.0f} dB above the model")
    return 0
