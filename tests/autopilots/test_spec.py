"""From parameters to a design spec: what the autopilots' own controllers do, what the examples say, what is refused."""

import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dob_companion.autopilots import Aircraft, Parameters, Sourced, parse_parameters, recognized, spec_text
from dob_companion.errors import InputError, SpecError
from dob_companion.synthesis import design_from_toml
from dob_companion.synthesis.plant.models import discretize, polynomial
from dob_companion.synthesis.spec.parse import parse_spec
from dob_companion.synthesis.tune.tuning import tuned_design_from_toml
from tests.autopilots.firmware import OVERSAMPLED, AcPid, Px4Rate, answer, ardupilot_notch, px4_notch

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data" / "parameters"
PARAMETERS = ("copter.param", "tailsitter.param", "quad.params")
GIVEN = Aircraft(gains={"": 100.0})
TWO = Sourced(2, "given")
WEIGHTS = """
[block.weights.disturbance]
zeros = [-0.8997]
poles = [0.9962]
gain = 0.19908
[block.weights.noise]
zeros = [0.9949]
poles = [-0.925]
gain = 3.7584
"""


def parameters(name, **changed):
    path = DATA / name
    read = parse_parameters(path.read_text(encoding="utf-8"), path.name)
    return replace(read, values={**read.values, **changed})


def made(these, aircraft=GIVEN):
    return spec_text(
        recognized(these), these, aircraft, rate_hz=250.0, delay_samples=TWO, noise_rms=Sourced(5e-4, "given")
    )


def blocks(text):
    return {block["name"]: block for block in tomllib.loads(text)["block"]}


def value(model, hz):
    """Of a model in s at a frequency."""
    s = 2j * np.pi * hz
    return np.polyval(model["num"], s) / np.polyval(model["den"], s)


def at_design_rate(model, hz):
    """The value at a frequency of what `design` makes of a model."""
    whole = discretize(polynomial(model["num"], model["den"], 0.0), 0.004, model["method"])
    return complex(whole(np.exp(2j * np.pi * hz * 0.004)).item())


@pytest.mark.parametrize(
    ("file", "example"), [("copter.param", "ardupilot_copter.toml"), ("quad.params", "px4_sih.toml")]
)
def test_the_controllers_of_default_parameters_are_those_of_the_example_but_for_the_loop(file, example):
    """Which takes loops as infinitely fast."""
    shown = blocks((ROOT / "examples" / example).read_text(encoding="utf-8"))
    for axis, block in blocks(made(parameters(file, SCHED_LOOP_RATE=1e8, IMU_GYRO_RATEMAX=1e8))).items():
        for hz in (0.1, 3.0, 30.0):
            mine, theirs = (value(each["controller"], hz) for each in (block, shown[axis]))
            assert mine == pytest.approx(theirs, rel=1e-5)


def test_ardupilots_moment_is_read_by_its_script_and_px4s_is_told_of_each_sample():
    read = {file: tomllib.loads(made(parameters(file)))["auto"].get("moment_rate_hz") for file in PARAMETERS}
    assert read == {"copter.param": 180, "tailsitter.param": 180, "quad.params": None}


def test_a_tail_sitters_controllers_are_those_of_its_example():
    shown = blocks((ROOT / "examples" / "ardupilot_tailsitter.toml").read_text(encoding="utf-8"))
    for axis, block in blocks(made(parameters("tailsitter.param"))).items():
        for hz in (0.1, 3.0, 30.0):
            mine, theirs = (value(each["controller"], hz) for each in (block, shown[axis]))
            assert mine == pytest.approx(theirs, rel=1e-5)


@pytest.mark.parametrize("hz", [0.5, 3.0, 10.0, 20.0])
@pytest.mark.parametrize(
    ("axis", "changed"),
    [("roll", {}), ("yaw", {}), ("roll", {"ATC_RAT_RLL_FLTE": 30.0}), ("roll", {"ATC_RAT_RLL_FLTD": 0.0})],
)
def test_the_controller_answers_as_ardupilots_does(axis, changed, hz):
    these = parameters("copter.param", **changed)
    short = {"roll": "RLL", "yaw": "YAW"}[axis]
    own = AcPid(*(these.values[f"ATC_RAT_{short}_{what}"] for what in ("P", "I", "D", "FLTE", "FLTD")))
    mine = at_design_rate(blocks(made(these))[axis]["controller"], hz)
    assert abs(mine / -answer(own, hz, 400.0) - 1.0) < 0.03


@pytest.mark.parametrize("hz", [0.5, 3.0, 10.0, 20.0])
@pytest.mark.parametrize("axis", ["roll", "yaw"])
def test_the_controller_answers_as_px4s_does(axis, hz):
    these = parameters("quad.params", MC_ROLLRATE_K=1.5)
    name = {"roll": "MC_ROLLRATE_", "yaw": "MC_YAWRATE_"}[axis]
    gains = (these.values[name + what] for what in "PIDK")
    own = Px4Rate(*gains, 400.0, 40.0, 20.0, 2.0 if axis == "yaw" else 0.0)
    mine = at_design_rate(blocks(made(these))[axis]["controller"], hz)
    held = answer(own, hz, 400.0 * OVERSAMPLED) / np.mean(
        np.exp(-2j * np.pi * hz * 0.0025 * np.arange(OVERSAMPLED) / OVERSAMPLED)
    )
    assert abs(mine / -held - 1.0) < 0.03


def ratio(file, part, hz, **changed):
    """What these parameters change in the roll block."""
    with_it, without = (blocks(made(parameters(file, **more)))["roll"][part] for more in (changed, {}))
    return value(with_it, hz) / value(without, hz)


@pytest.mark.parametrize("hz", [5.0, 20.0, 60.0])
def test_a_static_notch_of_ardupilot_stands_in_the_plant(hz):
    notch = {"INS_HNTCH_ENABLE": 1, "INS_HNTCH_MODE": 0, "INS_HNTCH_FREQ": 80, "INS_HNTCH_BW": 40}
    notch |= {"INS_HNTCH_ATT": 40, "INS_HNTCH_HMNCS": 1, "INS_HNTCH_OPTS": 0}
    assert ratio("copter.param", "plant", hz, **notch) == pytest.approx(
        ardupilot_notch(4000.0, 80.0, 40.0, 40.0, hz), rel=2e-3
    )


@pytest.mark.parametrize("hz", [5.0, 20.0, 60.0])
def test_a_static_notch_of_px4_stands_in_the_controller(hz):
    notch = {"IMU_GYRO_NF0_FRQ": 80.0}
    assert ratio("quad.params", "controller", hz, **notch) == pytest.approx(px4_notch(4000.0, 80.0, 20.0, hz), rel=2e-3)
    assert ratio("quad.params", "plant", hz, **notch) == pytest.approx(1.0)


def test_a_notch_that_moves_is_said_and_not_modelled():
    these = parameters("copter.param", INS_HNTCH_ENABLE=1, INS_HNTCH_MODE=3, INS_HNTCH_FREQ=80, INS_HNTCH_BW=40)
    text = made(these)
    assert re.search(r"#   INS_HNTCH_MODE = 3[^:]*: .*?not modelled", text, re.DOTALL)
    assert blocks(text) == blocks(made(parameters("copter.param")))


def test_the_streamed_rate_of_ardupilot_is_late_by_its_gyro_filter_that_of_px4_by_half_a_sample():
    aircraft = Aircraft(gains={"": 100.0}, poles={"": 2.0}, motors_s={"": 0.02}, delays_s={"roll": 0.003})
    for file, late in (("copter.param", 2**0.5 / (2 * np.pi * 20.0)), ("quad.params", 0.002)):
        plant = blocks(made(parameters(file), aircraft))["roll"]["plant"]
        num, den = (np.array(plant[key][::-1]) for key in ("num", "den"))
        assert num[0] / den[0] == pytest.approx(100.0 / 2.0)
        filtered = den[1] / den[0] - 0.02 - 1.0 / 2.0
        assert filtered + plant["delay_s"] == pytest.approx(late + 0.003)


def test_each_parameter_stands_beside_what_it_made():
    text = made(parameters("copter.param"))
    for name in ("ATC_RAT_PIT_D = 0.0036", "ATC_RAT_YAW_FLTE = 2.5", "INS_GYRO_FILTER = 20 Hz", "ATC_ANG_RLL_P = 4.5"):
        assert name in text
    assert max(map(len, text.splitlines())) <= 120


def test_a_plant_without_a_gain_is_refused_by_design_with_its_key():
    text = made(parameters("copter.param"), Aircraft(gains={"roll": 100.0, "yaw": 10.0}))
    with pytest.raises(SpecError, match=r"block 'pitch': plant: num: .*REQUIRED: angular acceleration"):
        parse_spec(text)


def roll_of_a_copter():
    """The spec of a made one's roll alone."""
    whole = made(parameters("copter.param"), Aircraft(gains={"": 306.0}, poles={"": 2.4}, delays_s={"": 0.0023}))
    return whole[: whole.index("[[block]]", whole.index("[[block]]") + 1)]


def test_a_made_spec_is_designed_with_weights_of_ones_own():
    head, block = roll_of_a_copter().split("[auto]")
    roll = head + block[block.index("[[block]]") :] + WEIGHTS
    (found,) = design_from_toml(roll, "made.toml", "2026-01-01T00:00:00+00:00").blocks
    assert found.certificate.gamma <= 1.01 * found.certificate.gamma_star


@pytest.mark.proof
def test_a_made_spec_is_designed_by_auto():
    roll = roll_of_a_copter()
    design, _ = tuned_design_from_toml(roll, "made.toml", "2026-01-01T00:00:00+00:00", None, lambda _: None)
    certificate = design.blocks[0].certificate
    assert certificate.disk_margin >= 0.25
    assert certificate.estimation_bandwidth_hz > 1.0


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"ATC_RAT_PIT_FLTD": None}, r"copter\.param: parameter ATC_RAT_PIT_FLTD is missing"),
        ({"ATC_RAT_YAW_P": -1.0}, r"parameter ATC_RAT_YAW_P is -1, expected a number of 0 or more"),
        ({"SCHED_LOOP_RATE": 0.0}, r"parameter SCHED_LOOP_RATE is 0, expected a number above 0"),
        ({"ATC_RAT_RLL_P": 0, "ATC_RAT_RLL_I": 0, "ATC_RAT_RLL_D": 0}, "the roll rate controller's gains are all 0"),
    ],
)
def test_what_is_missing_or_useless_is_one_line_that_names_the_parameter(changed, words):
    these = parameters("copter.param")
    values = {**these.values, **changed}
    with pytest.raises(InputError, match=words):
        made(Parameters(these.source, {name: value for name, value in values.items() if value is not None}))


def test_a_quadplanes_parameters_are_known_by_their_own_prefix():
    these = parameters("copter.param")
    plane = Parameters("plane.param", {name.replace("ATC_", "Q_A_"): value for name, value in these.values.items()})
    assert blocks(made(plane)) == blocks(made(these))


@pytest.mark.parametrize(
    "line",
    [
        "ATC_RAT_RLL_P,0.135",
        "ATC_RAT_RLL_P 0.135",
        "ATC_RAT_RLL_P\t0.135   # default",
        "\ufeffATC_RAT_RLL_P , 0.135 , dimensionless",
        "1\t1\tATC_RAT_RLL_P\t0.135000005364418030\t9\r",
        "# one\n\nATC_RAT_RLL_P=0.135\n#two",
        "1 191 DOB_ENABLE 0 9\n1 1 ATC_RAT_RLL_P 0.135 9",
    ],
)
def test_the_files_of_every_ground_station_are_read(line):
    assert parse_parameters(line, "file").values == {"ATC_RAT_RLL_P": pytest.approx(0.135)}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("A,1\n<html>", "file: line 2: expected NAME,VALUE, got '<html>'"),
        ("A,none", "file: line 1: parameter A is 'none', expected a finite number"),
        ("A,nan", "file: line 1: parameter A is 'nan'"),
        ("A,1\nA,2", "file: line 2: parameter A is 1 and 2 in one file"),
        ("A", "file: line 1: expected NAME,VALUE, got 'A'"),
        ("# nothing", "file: no parameters in it"),
        ("1 1 A 2 9\n2 1 B 2 9", "file: parameters of several vehicles (1, 2)"),
    ],
)
def test_a_file_that_is_none_is_one_line_with_its_place(text, words):
    with pytest.raises(InputError, match=re.escape(words)):
        parse_parameters(text, "file")


def test_parameters_without_a_rate_controller_are_nobodys():
    with pytest.raises(InputError, match="ATC_RAT_RLL_P"):
        recognized(Parameters("file", {"SYSID_THISMAV": 1.0}))
