import re

import control as ct
import numpy as np
import pytest

from dob_companion.errors import SpecError, UnsolvableError
from dob_companion.synthesis import design_from_toml, synthesize, zpk
from tests.synthesis import paper
from tests.synthesis.problems import static


def refusal(plant=paper.PLANT, controller=paper.PID, W_d=paper.W_D, W_n=paper.W_N, **options):
    with pytest.raises(UnsolvableError) as caught:
        synthesize(plant, controller, W_d, W_n, **options)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_an_unstable_baseline_names_the_mode_and_its_growth():
    message = refusal(controller=paper.PID * -1.0, axes=("pitch",))
    assert re.search(r"baseline loop of pitch .* is not stable: mode z = 1\.\d+.* grows by a factor", message)


def test_an_unstable_baseline_of_two_axes_names_the_one():
    stack = [zpk([], [pole], 0.1, paper.DT) for pole in (0.9, 1.0)]
    controller = static(np.diag([0.1, -0.1]))
    W_d, W_n = ct.append(paper.W_D, paper.W_D), ct.append(paper.W_N, paper.W_N)
    message = refusal(ct.append(*stack), controller, W_d, W_n, axes=("roll", "yaw"))
    assert message.startswith("baseline loop of yaw ")
    assert "mode z = 1.01 " in message


def test_a_plant_pole_beyond_the_rate_names_axis_and_pole():
    message = refusal(plant=zpk([], [3.0], 0.1, paper.DT), axes=("roll",))
    assert "plant of roll: mode z = 3" in message
    assert "outside what the rate can carry" in message


@pytest.mark.parametrize("which", ["W_d", "W_n"])
def test_a_weight_that_is_not_stable_is_refused(which):
    message = refusal(**{which: zpk([], [1.0], 0.1, paper.DT)})
    assert {"W_d": "disturbance", "W_n": "noise"}[which] in message
    assert "z = 1 (0 Hz, neither grows nor decays)" in message


def test_a_hidden_integrator_is_refused():
    """The second state is reached by nothing: no loop can hold it."""
    plant = ct.ss([[0.9, 0.1], [0.0, 1.0]], [[0.1], [0.0]], [[1.0, 0.0]], [[0.0]], paper.DT)
    message = refusal(plant=plant, controller=static(0.1))
    assert "plant: mode z = 1" in message
    assert "cannot be reached" in message


def test_a_disturbance_weight_of_nothing_is_refused():
    assert "nothing to estimate" in refusal(W_d=static(0.0))


def test_an_algebraic_baseline_loop_is_refused():
    assert "1 + G C is singular" in refusal(plant=static(1.0), controller=static(-1.0))


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"controller": static(np.ones((2, 1)))}, "controller: 2x1, expected 1x1"),
        ({"W_d": static(np.ones((2, 2)))}, "disturbance weight: 2x2, expected 1x2"),
        ({"W_n": zpk([0.9], [0.1], 1.0, 0.01)}, "noise weight: dt is 0.01, expected the plant's 0.004"),
        ({"delay_samples": (1, 1)}, "delay_samples: [1, 1], expected 1 of 0 or more"),
        ({"plant": ct.ss(-1.0, 1.0, 1.0, 0.0), "controller": ct.ss([], [], [], [[0.1]])}, "dt"),
    ],
)
def test_systems_that_do_not_fit_say_which_and_how(change, expected):
    names = {"plant": paper.PLANT, "controller": paper.PID, "W_d": paper.W_D, "W_n": paper.W_N}
    options = {k: v for k, v in change.items() if k not in names}
    systems = [change.get(k, v) for k, v in names.items()]
    with pytest.raises(SpecError) as caught:
        synthesize(*systems, **options)
    assert expected in str(caught.value)


def test_a_refusal_names_file_and_block():
    with pytest.raises(UnsolvableError, match=r"^my\.toml: block 'pitch': baseline loop"):
        design_from_toml(paper.spec_text().replace("gain = 0.9002", "gain = -0.9002"), "my.toml")
