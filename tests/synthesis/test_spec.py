import math

import numpy as np
import pytest

from dob_companion.errors import SpecError, UnsolvableError
from dob_companion.synthesis import design_from_toml, parse_spec
from dob_companion.synthesis.spec.parse import Entries, Polynomial, Zpk
from tests.synthesis import paper

TWO_AXES = """
[design]
rate_hz = 250.0
delay_samples = 2
[[block]]
name = "lateral"
axes = ["roll", "yaw"]
delay_samples = 3
[[block.plant.entry]]
from = "roll"
to = "roll"
num = [0.1]
den = [1.0, -0.9]
[[block.plant.entry]]
from = "yaw"
to = "roll"
zeros = []
poles = [[0.8, 0.1]]
gain = 0.01
[block.controller]
A = []
B = []
C = []
D = [[1.0, 0.0], [0.0, 1.0]]
[block.weights.disturbance]
num = [0.1, 0.1]
den = [1.0, -0.99]
[block.weights.disturbance.yaw]
num = [0.2, 0.2]
den = [1.0, -0.99]
[block.weights.noise]
num = [1.0]
den = [1.0]
"""


def complaint(text):
    with pytest.raises(SpecError) as caught:
        parse_spec(text, "my.toml")
    message = str(caught.value)
    assert message.startswith("my.toml: ")
    assert "\n" not in message
    return message


def pitch_with(old, new):
    text = paper.spec_text()
    assert old in text
    return text.replace(old, new, 1)


def test_the_example_reads_as_three_axes():
    spec = parse_spec(paper.spec_text())
    assert [block.axes for block in spec.blocks] == [("pitch",), ("roll",), ("yaw",)]
    assert spec.dt == pytest.approx(0.004)
    assert spec.blocks[0].plant.form == Zpk((-1.716,), (1.0, 0.9447), 0.14131)


def test_a_coupled_block_with_entries_own_weights_and_own_delay():
    (block,) = parse_spec(TWO_AXES).blocks
    assert block.delay_samples == 3
    assert isinstance(block.plant.form, Entries)
    (first, second) = block.plant.form.items
    assert first[:2] == (0, 0)
    assert isinstance(first[2].form, Polynomial)
    assert second[:2] == (0, 1)
    assert second[2].form.poles == (0.8 + 0.1j, 0.8 - 0.1j)
    assert [index for index, _ in block.disturbance.own] == [1]
    assert block.disturbance.common is not None


def test_delay_and_backoff_have_defaults():
    spec = parse_spec("\n".join(line for line in paper.spec_text().splitlines() if "delay" not in line))
    assert spec.delay_samples == 1
    assert all(block.delay_samples == 1 for block in spec.blocks)


@pytest.mark.parametrize(
    ("old", "new", "key", "hint"),
    [
        ("rate_hz", "rate_Hz", "rate_Hz", "rate_hz"),
        ("zeros = [-1.716]", "zeroes = [-1.716]", "zeroes", "zeros"),
        ("[block.plant] ", "[block.plnt] ", "plnt", "plant"),
        ("[block.weights.disturbance]", "[block.weights.disturbances]", "disturbances", "disturbance"),
        ('name = "pitch"', 'nmae = "pitch"', "nmae", "name"),
        ("[design]", "[desing]", "desing", "design"),
    ],
)
def test_an_unknown_key_names_the_nearest_one(old, new, key, hint):
    message = complaint(pitch_with(old, new))
    assert f"unknown key {key!r}; did you mean {hint!r}?" in message


@pytest.mark.parametrize(
    ("old", "new", "where", "expected"),
    [
        ("gain = 0.14131 ", "gain = nan ", "block 'pitch': plant: gain", "finite"),
        ("gain = 0.9002", "gain = inf", "block 'pitch': controller: gain", "finite"),
        ("gain = 0.9002", "gain = true", "block 'pitch': controller: gain", "finite"),
        ("zeros = [-1.716]", "zeros = [nan]", "block 'pitch': plant: zeros", "finite"),
        ("poles = [1.0, 0.9447]", 'poles = ["1.0"]', "block 'pitch': plant: poles", "finite"),
        ("poles = [1.0, 0.9447]", "poles = []", "block 'pitch': plant: zeros", "not causal"),
        ("rate_hz = 250.0", "rate_hz = -1", "design: rate_hz", "positive"),
        ("delay_samples = 1 ", "delay_samples = -1 ", "design: delay_samples", "0 or more"),
        ("delay_samples = 1 ", "delay_samples = 1.5 ", "design: delay_samples", "whole number"),
        ("gamma_backoff = 1.01", "gamma_backoff = 1.0", "design: gamma_backoff", "above 1"),
        ('axes = ["pitch"]', 'axes = ["pich"]', "axes", "roll, pitch, yaw"),
        ('axes = ["roll"]', 'axes = ["pitch"]', "block 'roll': axes", "already belongs"),
        ("gain = 0.9002", 'gain = 0.9002\nmethod = "zoh"', "controller: method", 'domain = "s"'),
        ("gain = 0.9002", 'gain = 0.9002\ndomain = "w"', "controller: domain", "one of z, s"),
        ("gain = 0.9002", "num = [1.0]", "controller", "one of zeros, poles, gain | num, den | A, B, C, D"),
    ],
)
def test_a_bad_value_names_place_key_and_expectation(old, new, where, expected):
    message = complaint(pitch_with(old, new))
    assert where in message
    assert expected in message


def test_text_that_is_not_toml_is_one_line():
    assert "not TOML" in complaint("[design\nrate_hz = 1")


def test_a_missing_block_is_named():
    assert "block" in complaint("[design]\nrate_hz = 250.0\n")


def test_an_entry_between_unknown_axes_is_refused():
    assert "'pitch' is not one of this block's axes" in complaint(TWO_AXES.replace('to = "roll"', 'to = "pitch"', 1))


def test_an_entry_given_twice_is_refused():
    assert "twice" in complaint(TWO_AXES.replace('from = "yaw"', 'from = "roll"', 1))


def test_weights_for_only_some_axes_are_refused():
    without = TWO_AXES.replace("[block.weights.disturbance]\nnum = [0.1, 0.1]\nden = [1.0, -0.99]\n", "")
    assert "no weight for roll" in complaint(without)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("D = [[1.0, 0.0], [0.0, 1.0]]", "D = [[1.0, 0.0]]", "1 outputs and 2 inputs, expected 2 and 2"),
        ("B = []", "B = [[1.0]]", "B is 1x1, expected 0x2"),
        ("num = [1.0]\nden = [1.0]\n", "A = []\nB = []\nC = []\nD = [[1.0], [0.0], [0.0]]\n", "noise: has 3 outputs"),
    ],
)
def test_wrong_shapes_name_the_place(old, new, expected):
    with pytest.raises(SpecError, match=r"my\.toml: block 'lateral': ") as caught:
        design_from_toml(TWO_AXES.replace(old, new, 1), "my.toml")
    assert expected in str(caught.value)


def test_a_continuous_model_is_discretized_at_the_rate():
    text = pitch_with("zeros = [-1.716]\npoles = [1.0, 0.9447]", 'domain = "s"\nzeros = []\npoles = [0.0, -14.2]')
    text = text.replace("gain = 0.14131 ", "gain = 24600.0 ", 1)
    block = design_from_toml(text.split("# Roll and yaw")[0]).blocks[0]
    poles = sorted(np.linalg.eigvals(block.problem.plant.A).real)
    assert poles == pytest.approx([math.exp(-14.2 * 0.004), 1.0])


def test_a_continuous_mode_above_half_the_rate_is_refused_with_its_frequency():
    text = pitch_with("zeros = [-1.716]\npoles = [1.0, 0.9447]", 'domain = "s"\nzeros = []\npoles = [[-5.0, 1000.0]]')
    with pytest.raises(UnsolvableError, match=r"'pitch': plant: mode at 159.2 Hz lies above half the rate, 125 Hz"):
        design_from_toml(text)
