"""Models from .mat and .npz files of other tools."""

import io

import numpy as np
import pytest
from scipy.io import savemat

from dob_companion.errors import InputError, SpecError
from dob_companion.synthesis import design_from_toml, parse_spec
from tests.synthesis.paper import PLANT

SPEC = """
[design]
rate_hz = 250.0
[[block]]
name = "pitch"
axes = ["pitch"]
[block.plant]
file = "{name}"
[block.controller]
zeros = [0.8343, 0.9987]
poles = [0.0, 1.0]
gain = 0.9002
[block.weights.disturbance]
zeros = [-0.8997]
poles = [0.9962]
gain = 0.19908
[block.weights.noise]
zeros = [0.9949]
poles = [-0.925]
gain = 3.7584
"""
MATRICES = {key: getattr(PLANT, key) for key in "ABCD"}


def packed(name, values):
    out = io.BytesIO()
    if name.endswith(".mat"):
        savemat(out, values)
    else:
        np.savez(out, **values)
    return out.getvalue()


def reader(name, values):
    data = packed(name, values)
    return {name: data}.__getitem__


@pytest.mark.parametrize("name", ["plant.mat", "plant.npz"])
def test_a_plant_from_a_file_gives_the_design_of_its_roots(name):
    design = design_from_toml(SPEC.format(name=name), "s.toml", "", reader(name, MATRICES | {"Ts": 0.004}))
    assert design.blocks[0].certificate.gamma_star == pytest.approx(1.59982, rel=1e-3)


def test_a_model_without_a_sample_time_is_continuous_and_says_so():
    values = {"A": [[-10.0]], "B": [[10.0]], "C": [[1.0]], "D": [[0.0]]}
    spec = parse_spec(SPEC.format(name="p.npz"), "s.toml", reader("p.npz", values))
    assert spec.blocks[0].plant.domain == "s"


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"A": MATRICES["A"]}, "B, C, D is missing"),
        (MATRICES | {"Ts": 0.01}, "Ts is 0.01 s"),
        (MATRICES | {"A": np.array([["a"]])}, "A: expected a real matrix"),
        (MATRICES | {"A": np.array([[1j]])}, "A: expected a real matrix"),
    ],
)
def test_a_file_of_something_else_is_named_with_its_key(values, words):
    with pytest.raises(SpecError) as caught:
        parse_spec(SPEC.format(name="p.npz"), "s.toml", reader("p.npz", values))
    assert "p.npz" in str(caught.value)
    assert words in str(caught.value)
    assert "block.plant.file" in str(caught.value)


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04junk", b"MATLAB 5.0 MAT-file" + b"\0" * 200, b"\x00" * 64])
@pytest.mark.parametrize("name", ["p.mat", "p.npz"])
def test_a_torn_file_is_one_line(name, data):
    with pytest.raises(SpecError) as caught:
        parse_spec(SPEC.format(name=name), "s.toml", lambda _: data)
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_cannot_be_read_or_named_is_one_line():
    def missing(name):
        raise InputError(f"{name}: cannot be read: No such file or directory")

    with pytest.raises(SpecError, match="No such file"):
        parse_spec(SPEC.format(name="p.npz"), "s.toml", missing)
    with pytest.raises(SpecError, match=r"expected the name of a \.mat or \.npz file"):
        parse_spec(SPEC.format(name="p.csv"), "s.toml", missing)
    with pytest.raises(SpecError, match="text alone"):
        parse_spec(SPEC.format(name="p.npz"), "s.toml")
