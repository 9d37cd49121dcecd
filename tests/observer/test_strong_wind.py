"""What strong wind leaves unforeseen has no rhythm of its own."""

import numpy as np
import pytest

from dob_companion.artifact import AXES
from dob_companion.observer import GyroModel, StrongWind
from tests.scenarios.designs import design_named

DESIGN = design_named("tailsitter_paper.toml")
BLOCK = DESIGN.blocks[0]
AXIS = AXES.index(BLOCK.axes[0])


def innovation(model, seconds=60.0, strength=0.1, noise=4e-4):
    """Of the first block's axis, whose moment is noise through 1 Hz that nobody reports; rad/s, (N,)."""
    plant, rng = BLOCK.problem.plant, np.random.default_rng(1)
    pole = np.exp(-2.0 * np.pi * DESIGN.dt)
    x, wind, out = np.zeros(len(plant.A)), 0.0, []
    for w, n in rng.standard_normal((round(seconds / DESIGN.dt), 2)):
        wind = pole * wind + strength * np.sqrt(1.0 - pole**2) * w
        rates = [0.0, 0.0, 0.0]
        rates[AXIS] = float((plant.C @ x)[0]) + noise * n
        out.append(model.advance(tuple(rates), (0.0, 0.0, 0.0))[AXIS])
        x = plant.A @ x + plant.B[:, 0] * wind
    return np.array(out)


def decibels(values, low, high):
    """Mean power density from `low` to `high` Hz."""
    power, hz = np.abs(np.fft.rfft(values)) ** 2, np.fft.rfftfreq(len(values), DESIGN.dt)
    return 10.0 * np.log10(power[(hz >= low) & (hz < high)].mean())


def test_it_falls_less_over_the_frequencies_at_which_loops_ring_than_the_designs_own():
    own, here = (innovation(model) for model in (GyroModel(DESIGN, longest=0), StrongWind(DESIGN)))
    fall = [decibels(values, 5.0, 9.0) - decibels(values, 20.0, 31.0) for values in (own, here)]
    assert fall[0] > 6.0
    assert abs(fall[1]) < 4.0


def test_in_the_middle_of_them_it_is_as_large():
    own, here = (innovation(model) for model in (GyroModel(DESIGN, longest=0), StrongWind(DESIGN)))
    assert decibels(here, 11.0, 13.0) == pytest.approx(decibels(own, 11.0, 13.0), abs=1.0)


def test_a_right_plant_leaves_it_nothing_but_noise():
    calm = innovation(StrongWind(DESIGN), seconds=10.0, strength=0.0)
    assert np.abs(calm).max() < 0.02
