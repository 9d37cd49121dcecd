"""The simulated tail-sitter from hover to a design, no model given, beside the design of its true linearization.

    python -m tests.identification.tailsitter [-o DIR] [--seeds 1 2 3] [--seconds S]

It bends, the air moves, the gyro is noisy and the link two samples late (`hover.toml`). `tune --link` excites it and
makes a design; the same spec with the linearized equations of motion in place of what was found, uncertain only in what
a rigid model leaves of them, makes another. Both fly `flown.toml`.
"""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from dob_companion.artifact import dumps
from dob_companion.autopilots.transfer import NOTHING, Transfer
from dob_companion.autopilots.written import model_lines
from dob_companion.identification.bound import LEAST, MOST_BELOW
from dob_companion.identification.fit import DELAY, Data, Fit, rigid
from dob_companion.identification.result import Bound
from dob_companion.identification.views import reference_of
from dob_companion.synthesis.tune.tuning import tuned_design_from_toml
from sitl.calibration import disturbance_scale
from sitl.campaign.fleet import local
from sitl.campaign.pilot import Job
from sitl.campaign.plan import Inputs
from sitl.constants import AXES, DT
from sitl.scenario.spec import load
from sitl.tailsitter.parameters import Parameters
from sitl.tailsitter.trim import linearize
from tests.clients.processes import process
from tests.ports import free_port

HERE = Path(__file__).parent
HOVER, FLOWN = HERE / "hover.toml", HERE / "flown.toml"
LINK_SAMPLES = 2
BAND_HZ, BOUND_HZ, KNOT = (1.0, 60.0), (0.05, 110.0), 2
WIND = (-2.0, 0.0, 0.0)
"""m/s to north, east, down: the mean of both scenarios."""


def tuned(out: Path, seed: int, seconds: float) -> None:
    """`tune --link` in the simulated vehicle's hover: nothing else is told. Raises CalledProcessError."""
    link, ground = free_port(), free_port()
    ends = ("--link", f"udpout:127.0.0.1:{link}", "--gcs", f"udpout:127.0.0.1:{ground}")
    vehicle = ("-m", "sitl", HOVER, "--clock", "lockstep", "--delay", str(LINK_SAMPLES), "--seed", str(seed), *ends)
    with process(*vehicle):
        own = ("--link", f"udpin:127.0.0.1:{link}", "--seconds", f"{seconds:g}", "--no-rehearsal", "-o", str(out))
        subprocess.run([sys.executable, "-m", "dob_companion", "tune", *own], check=True)


def truth(axis: str) -> tuple[Fit, Bound]:
    """From the torque that acts to the gyro's rate about one axis, by the equations of motion, in the mean wind: a
    rigid model, and how far it is off.

    Its modes are left to the bound, as those of what is found are: with them in the model `design --auto` finds no
    observer at all. Below the band the bound ends where that of what is found does.
    """
    k, whole = AXES.index(axis), linearize(Parameters(), WIND)
    frequency = 2.0 * np.pi * np.geomspace(*BAND_HZ, 100)
    response = whole.response(frequency, k)
    model = rigid(Data(frequency, response, 0.01 * np.abs(response), NOTHING, DT))
    hertz = np.geomspace(*BOUND_HZ, 1201)
    bends = linearize(Parameters(), WIND, flexible=True).response(2.0 * np.pi * hertz, k)
    off = np.abs(bends / model.response(2.0 * np.pi * hertz, DT) - 1.0)
    off = np.where(hertz < BAND_HZ[0], np.minimum(off, MOST_BELOW), off)
    knots = range(0, len(hertz), KNOT)
    values = [float(np.max(off[max(0, at - KNOT) : at + KNOT + 1])) for at in knots]
    return model, Bound(tuple(float(hertz[at]) for at in knots), tuple(max(LEAST, value) for value in values), BAND_HZ)


def with_truth(spec: str) -> str:
    """An identified spec with the true plants, uncertain only in what their form leaves."""
    head, *blocks = spec.split("[[block]]")
    return "[[block]]".join([head, *map(_with_truth, blocks)])


def _with_truth(block: str) -> str:
    axis = next(axis for axis in AXES if f'name = "{axis}"' in block)
    before, _, rest = block.partition("[block.plant]\n")
    controller = rest[rest.index("[block.controller]") : rest.index("[block.uncertainty]")]
    true, bound = truth(axis)
    whole = Transfer((true.gain,), (1.0,)) * reference_of(true.parameters, NOTHING)
    plant = "\n".join(model_lines(whole, "zoh", float(true.parameters[DELAY])))
    uncertain = "\n".join(f"{key} = {values}" for key, values in bound.to_object().items())
    return f"{before}[block.plant]\n{plant}\n{controller}[block.uncertainty]\n{uncertain}\n\n"


def designed(spec: str) -> str:
    """design.json of a spec, by `design --auto`."""
    design, _ = tuned_design_from_toml(spec)
    return dumps(design)[0]


def flown(designs: Sequence[str], seeds: Sequence[int]) -> list[list[dict[str, float]]]:
    """RMS attitude error off / on by axis, of each design and seed."""
    scenario, jobs = load(str(FLOWN)), []
    with ProcessPoolExecutor(2) as pool:
        scales = list(pool.map(_scale, seeds))
    for text in designs:
        for seed, scale in zip(seeds, scales, strict=True):
            inputs = Inputs(len(jobs), seed, scenario.airframe, "", LINK_SAMPLES, 1.0, 1.0)
            jobs.append(Job(inputs, scenario, scale, text, {}))
    rows = sorted((row for some in local(jobs, 2) for row in some), key=lambda row: row["flight"])
    for row in rows:
        if row["outcome"] != "complete" or row["injecting"] < 1.0:
            raise RuntimeError(f"flight {row['flight']}: {row['outcome']}, {row['reason']}")
    ratios = [{axis: float(row[f"rms_ratio_{axis}"]) for axis in AXES} for row in rows]
    return [ratios[k : k + len(seeds)] for k in range(0, len(ratios), len(seeds))]


def _scale(seed: int) -> tuple[float, float, float]:
    return disturbance_scale(load(str(FLOWN)), seed)


def compared(out: Path, seeds: Sequence[int], seconds: float) -> list[tuple[dict[str, float], dict[str, float]]]:
    """Off / on of the design that was found and of the one that knows, for each seed of the vehicle's air and noise."""
    found = []
    for seed in seeds:
        place = out / f"seed-{seed}"
        tuned(place, seed, seconds)
        spec = (place / "spec.toml").read_text(encoding="utf-8")
        knows = designed(with_truth(spec))
        (place / "knows.json").write_text(knows, encoding="utf-8")
        (own,), (other,) = flown([(place / "design.json").read_text(encoding="utf-8"), knows], [seed])
        found.append((own, other))
    return found


def table(found: Sequence[tuple[dict[str, float], dict[str, float]]], seeds: Sequence[int]) -> Iterator[str]:
    """A row a seed, and how far the worst is behind."""
    yield f"| seed | {' | '.join(f'{axis}: found, knowing' for axis in AXES)} |"
    yield "| --- " * (1 + len(AXES)) + "|"
    for seed, (own, other) in zip(seeds, found, strict=True):
        yield f"| {seed} | {' | '.join(f'{own[axis]:.1f}, {other[axis]:.1f}' for axis in AXES)} |"
    shares = [np.median([own[axis] / other[axis] for own, other in found]) for axis in AXES]
    yield f"| median of found / knowing | {' | '.join(f'{share:.2f}' for share in shares)} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.identification.tailsitter", description=__doc__)
    parser.add_argument("-o", type=Path, metavar="DIR", help="keep what was found here")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], metavar="N")
    parser.add_argument("--seconds", type=float, default=30.0, metavar="S", help="of excitation an axis (%(default)g)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        print("\n".join(table(compared(options.o or Path(scratch), options.seeds, options.seconds), options.seeds)))


if __name__ == "__main__":
    main()
