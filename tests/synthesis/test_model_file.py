"""Models from .mat and .npz files of other tools."""

import io

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_array

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
WITH_DOMAIN = SPEC.format(name="p.npz").replace('"p.npz"', '"p.npz"\ndomain = "{}"')
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


DISCRETE_UNSTATED = r"-1 or true \(discrete, its sample time not stated\)"


@pytest.mark.parametrize(
    ("step", "words"),
    [
        (-1.0, f"is {DISCRETE_UNSTATED}"),
        (np.True_, f"is {DISCRETE_UNSTATED}"),
        (np.nan, "is nan, expected a number of s"),
        (np.inf, "is inf, expected a number of s"),
        (-0.004, "is -0.004, expected a number of s"),
        (np.zeros((0, 0)), "expected a number of s, got none"),
        ([0.004, 0.004], "expected a number of s, got 2"),
        ("0.004", "expected a number of s, got text"),
        (0.004 + 1j, "expected a number of s, got complex numbers"),
        (np.array([[0.004]], dtype=object), "expected a number of s, got a cell"),
        (0.01, "is 0.01 s, expected 1 / design.rate_hz"),
    ],
)
@pytest.mark.parametrize("name", ["p.mat", "p.npz"])
def test_a_sample_time_that_is_not_the_specs_is_refused_and_never_guessed(name, step, words):
    """A logical of MATLAB's comes back as a number: 1 s is refused as well, in other words."""
    if name == "p.mat" and step is np.True_:
        words = "is 1 s, expected 1 / design.rate_hz"
    with pytest.raises(SpecError, match=rf"block\.plant\.file: {name}: Ts:? {words}"):
        parse_spec(SPEC.format(name=name), "s.toml", reader(name, MATRICES | {"Ts": step}))


def test_none_as_pythons_sample_time_is_refused_in_words():
    data = packed("p.npz", MATRICES | {"dt": np.array(None, dtype=object)})
    with pytest.raises(SpecError, match=r"p\.npz: dt: expected a number of s, got a cell, struct or object"):
        parse_spec(SPEC.format(name="p.npz"), "s.toml", {"p.npz": data}.__getitem__)


@pytest.mark.parametrize("step", [{"Ts": -1.0}, {"Ts": 0.004}, {}, {"dt": np.True_}])
def test_a_discrete_model_stays_discrete_where_the_spec_says_so_too(step):
    spec = parse_spec(WITH_DOMAIN.format("z"), "s.toml", reader("p.npz", MATRICES | step))
    assert spec.blocks[0].plant.domain == "z"


@pytest.mark.parametrize(
    ("domain", "step", "words"),
    [
        ("s", 0.004, "Ts is 0.004 s, but domain = 's' stands beside"),
        ("z", 0.0, r"Ts is 0 \(continuous\), but domain = 'z' stands beside"),
        ("s", -1.0, f"Ts is {DISCRETE_UNSTATED}, but domain = 's' stands beside"),
    ],
)
def test_a_domain_that_the_file_contradicts_is_refused(domain, step, words):
    with pytest.raises(SpecError, match=words):
        parse_spec(WITH_DOMAIN.format(domain), "s.toml", reader("p.npz", MATRICES | {"Ts": step}))


def test_two_sample_times_that_differ_are_refused():
    values = MATRICES | {"Ts": 0.004, "dt": 0.0}
    with pytest.raises(SpecError, match=r"Ts and dt differ: 0.004 s and 0 \(continuous\)"):
        parse_spec(SPEC.format(name="p.npz"), "s.toml", reader("p.npz", values))


@pytest.mark.parametrize("name", ["P.MAT", "P.Npz"])
def test_a_suffix_in_capitals_is_the_same_suffix(name):
    data = {name: packed(name.lower(), MATRICES | {"Ts": 0.004})}
    assert parse_spec(SPEC.format(name=name), "s.toml", data.__getitem__).blocks[0].plant.domain == "z"


def test_a_version_7_3_file_is_told_how_to_save():
    """The header that MATLAB writes: 124 bytes of text and offsets, then version 2.0, little-endian."""
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM"
    with pytest.raises(SpecError, match=r"p\.mat: a MATLAB v7\.3 \(HDF5\) file, .*'-v7'"):
        parse_spec(SPEC.format(name="p.mat"), "s.toml", lambda _: header + bytes(512))


def test_a_system_object_in_place_of_matrices_is_told_what_to_save():
    with pytest.raises(SpecError, match=r"got sys \(of an ss object: \[A, B, C, D\] = ssdata\(sys\)"):
        parse_spec(SPEC.format(name="p.mat"), "s.toml", reader("p.mat", {"sys": {"a": 1.0}}))


def test_sparse_matrices_are_matrices():
    values = {key: csc_array(np.atleast_2d(value)) for key, value in MATRICES.items()}
    spec = parse_spec(SPEC.format(name="p.mat"), "s.toml", reader("p.mat", values | {"Ts": 0.004}))
    assert tuple(map(tuple, PLANT.A)) == spec.blocks[0].plant.form.A


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
