"""The best observer of three coupled axes, beside the bound on every observer and beside the same axes apart: time.

The paper's dynamics with gains 0.6, 1 and 0.35 behind a mixer whose entries off the diagonal are a share of those of
`MIXER`. Attenuation is the RMS attitude error off / on of all axes together, disturbances through a 1 Hz low-pass on
every moment, one sample of delay. First comes what `design --auto` makes; as modelled, with no other gains in the
objective; then the same of eight states for each moment, on the poles of the best observer of each axis alone. Times
are of one core: of `design --auto`, its trade-off and every row's bound included, and of one bound.
"""

import time
from collections.abc import Iterator

import control as ct
import numpy as np
from numpy.typing import NDArray

from dob_companion.synthesis.optimal.asked import spectrum_of
from dob_companion.synthesis.optimal.bound import attenuation_limit
from dob_companion.synthesis.optimal.coupled import Programme, Row
from dob_companion.synthesis.optimal.problem import Axis, Block, Spectrum, Wanted
from dob_companion.synthesis.optimal.search import Search
from dob_companion.synthesis.plant.minimal import minimal
from dob_companion.synthesis.plant.models import stack
from dob_companion.synthesis.spec.auto import AutoSpec
from dob_companion.synthesis.spec.parse import BlockSpec, parse_spec
from dob_companion.synthesis.tune.tuning import Task, designed_and_tuned

DT = 0.004
PLANT = ct.ss(ct.zpk([-1.716], [1.0, 0.9447], 0.14131, dt=DT))
PID = ct.ss(ct.zpk([0.8343, 0.9987], [0.0, 1.0], 0.9002, dt=DT))
GAINS = (0.6, 1.0, 0.35)
MIXER = np.array([[1.0, 0.15, -0.1], [0.1, 1.0, 0.2], [-0.05, 0.1, 1.0]])
SHARES = (0.0, 0.25, 0.5, 1.0)
"""Of the mixer's coupling."""

ASKED = """
[design]
rate_hz = 250.0
delay_samples = 1
[auto]
disturbance_corner_hz = 1.0
noise_rms = 3.98e-4
least_disk_margin = 0.4
largest_noise_in_correction = 5e-4
"""

HEAD = (
    "coupling",
    "at gain 0.7, 1, 1.3",
    "any order",
    "of it",
    "as modelled",
    "of it",
    "eight each",
    "of it",
    "states",
    "s",
    "one bound, s",
)


def measure() -> Iterator[str]:
    """One row for each strength of coupling."""
    yield f"| {' | '.join(HEAD)} |"
    yield f"|{' --- |' * len(HEAD)}"
    for share in SHARES:
        yield f"| {' | '.join(_cells(share))} |"


def _cells(share: float) -> Iterator[str]:
    plant, controller = axes(np.eye(3) + share * (MIXER - np.eye(3)))
    block, auto = asked(plant, controller)
    yield f"{100.0 * share:.0f} %"
    begun = time.process_time()
    designed, tuning = designed_and_tuned(Task(block, DT, auto))
    took = time.process_time() - begun
    low, high = tuning.chosen.at_gains
    limit = tuning.limit or np.nan
    yield f"{low:.1f}, {tuning.chosen.attenuation:.1f}, {high:.1f}"
    yield f"{limit:.2f}"
    yield f"{100.0 * tuning.chosen.attenuation / limit:.1f} %"
    block, auto = asked(plant, controller, "gains = []\n")
    _, alone = designed_and_tuned(Task(block, DT, auto))
    yield f"{alone.chosen.attenuation:.1f}"
    yield f"{100.0 * alone.chosen.attenuation / limit:.1f} %"
    wanted = Wanted(
        disk_margin=auto.least_disk_margin, noise=auto.largest_noise, noise_rms=auto.noise_rms, gains=auto.gains
    )
    posed = Block(plant, controller, (1,) * 3, auto.attitude_gain)
    more = _of_eight_states_each(posed, spectrum_of(auto), wanted)
    yield f"{more:.1f}"
    yield f"{100.0 * more / limit:.1f} %"
    yield str(len(designed.observer.A))
    yield f"{took:.1f}"
    begun = time.process_time()
    attenuation_limit(posed, spectrum_of(auto), wanted)
    yield f"{time.process_time() - begun:.1f}"


def _of_eight_states_each(posed: Block, spectrum: Spectrum, wanted: Wanted) -> float:
    programme = Programme(posed, spectrum, wanted)
    rows = []
    for i, delay in enumerate(posed.delays):
        plant, controller = minimal(posed.plant[i, i]), minimal(posed.controller[i, i])
        found = Search(Axis.of(plant, controller, delay, posed.attitude_gain), spectrum, 8).best(wanted)
        assert found is not None
        rows.append(Row.of(posed.plant, found.solved.x, programme.radius))
    solved = programme.solve(tuple(rows))
    assert solved is not None
    return programme.attenuation(solved.X, 1.0)


def axes(mixer: NDArray[np.float64]) -> tuple[ct.StateSpace, ct.StateSpace]:
    """Plant and controller."""
    G = stack([gain * PLANT for gain in GAINS])
    plant = ct.ss(G.A, G.B @ mixer, G.C, G.D @ mixer, DT)
    return minimal(plant), minimal(stack([PID / gain for gain in GAINS]))


def asked(plant: ct.StateSpace, controller: ct.StateSpace, more: str = "") -> tuple[BlockSpec, AutoSpec]:
    """As a spec states it."""
    text = [ASKED, more, '[[block]]\nname = "all"\naxes = ["roll", "pitch", "yaw"]\n']
    for name, system in (("plant", plant), ("controller", controller)):
        text.append(f"[block.{name}]\n")
        text += [f"{key} = {np.asarray(getattr(system, key)).tolist()}\n" for key in "ABCD"]
    (block,) = parse_spec("".join(text)).blocks
    assert block.auto is not None
    return block, block.auto
