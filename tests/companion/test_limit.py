"""A design carries a limit of its own: the largest disturbance that its spec states."""

from dataclasses import replace
from pathlib import Path

import pytest

from dob_companion.artifact import LARGEST_DISTURBANCE, design_table, dumps, loads
from dob_companion.companion import Companion, CompanionConfig
from dob_companion.companion.parameters import limits_in_words
from dob_companion.doctor.diagnosis import _limit
from dob_companion.errors import SpecError
from dob_companion.synthesis import design_from_toml
from dob_companion.synthesis.spec.parse import parse_spec
from tests.companion.aircraft import Aircraft, small_design

PAPER = (Path(__file__).parents[2] / "examples" / "tailsitter_paper.toml").read_text("utf-8")


def spec_with(value):
    """The paper's pitch axis."""
    head, pitch, *_ = PAPER.split("[[block]]")
    return head + "[[block]]" + pitch.replace('axes = ["pitch"]', f'axes = ["pitch"]\nlargest_disturbance = {value}')


def design_for(*limits):
    """Blocks of roll, pitch, yaw with these limits; None states none."""
    design = small_design()
    blocks = [
        block
        if limit is None
        else replace(block, certificate=replace(block.certificate, extra={LARGEST_DISTURBANCE: limit}))
        for block, limit in zip(design.blocks, limits, strict=True)
    ]
    return loads(dumps(replace(design, blocks=tuple(blocks)))[0])


def limit_of(design, **parameters):
    return Companion(design, CompanionConfig(parameters=parameters)).parameters["DOB_LIMIT"]


def test_what_the_spec_states_is_in_the_file_and_in_the_table_and_is_the_default():
    design = loads(dumps(design_from_toml(spec_with(0.12)))[0])
    assert design.limit == 0.12
    assert "largest disturbance" in design_table(design)
    assert limit_of(design) == 0.12


def test_a_spec_that_states_none_leaves_it_out_of_the_table_and_the_default_alone():
    design = small_design()
    assert design.limit is None
    assert "largest disturbance" not in design_table(design)
    assert limit_of(design) == 0.3


def test_the_greatest_of_the_blocks_counts_and_one_that_says_nothing_makes_it_unknown():
    assert design_for(0.05, 0.06, 0.2).limit == 0.2
    assert design_for(0.05, None, 0.2).limit is None


def test_configuration_and_operator_go_before_it():
    design = design_for(0.1, 0.1, 0.1)
    assert limit_of(design, DOB_LIMIT=0.4) == 0.4
    plane = Aircraft(Companion(design))
    plane.heartbeat()
    plane.write("DOB_LIMIT", 0.25)
    assert plane.companion.parameters["DOB_LIMIT"] == 0.25


def test_a_correction_stays_within_it():
    plane = Aircraft(Companion(design_for(0.05, 0.05, 0.05))).active()
    plane.rates = (0.8, -0.8, 0.0)
    last = plane.pairs(100)[-1]
    assert (last.x, last.y) == pytest.approx((-0.05, 0.05), abs=1e-6)


@pytest.mark.parametrize("stated", [2.0, -0.1, 0.0, "0.1", True, None, float("nan")])
def test_a_file_that_states_no_such_number_states_none(stated):
    blocks = [
        replace(block, certificate=replace(block.certificate, extra={LARGEST_DISTURBANCE: stated}))
        for block in small_design().blocks
    ]
    assert replace(small_design(), blocks=tuple(blocks)).limit is None


@pytest.mark.parametrize("value", ["0", "1.5", "-0.1", "nan", '"much"', "true"])
def test_a_spec_may_state_a_number_above_0_and_at_most_1_only(value):
    with pytest.raises(SpecError, match="largest_disturbance: expected a number above 0, at most 1"):
        parse_spec(spec_with(value))


def test_run_and_doctor_say_it():
    known, unknown = design_for(0.1, 0.1, 0.1), small_design()
    assert limits_in_words(known, 0.1) == "DOB_LIMIT 0.1: the largest disturbance that the design is for"
    assert limits_in_words(known, 0.3) == "DOB_LIMIT 0.3: the design is for disturbances of 0.1 at most"
    assert "does not say" in limits_in_words(unknown, 0.3)
    assert next(_limit(known)).text == "the design is for disturbances of 0.1 at most: DOB_LIMIT"
    assert "state largest_disturbance" in next(_limit(unknown)).remedy
    assert list(_limit(None)) == []
