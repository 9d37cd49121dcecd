"""docs/paper.md: bounds decide what agrees, and the command prints the page again."""

import numpy as np
import pytest

from dob_companion.synthesis import design_from_toml
from docs.paper import frequency
from docs.paper.__main__ import ROOT, SPEC, make, no_delay
from docs.paper.hover import fit, lag_ms, lowpassed
from docs.paper.page import page
from docs.paper.section import Number


@pytest.mark.parametrize(("value", "agrees"), [(0.9, False), (1.0, True), (1.5, True), (2.0, True), (2.1, False)])
def test_a_number_agrees_within_its_bounds_and_not_beside_them(value, agrees):
    number = Number("gain", "1.5", value, "dB", 1.0, 2.0)
    assert number.agrees is agrees
    assert number.accepted == "1 … 2"


def test_an_estimate_that_lags_is_seen_to_lag():
    time = np.arange(5000) / 250.0
    true = np.sin(2.0 * np.pi * 0.3 * time) + np.sin(2.0 * np.pi * 0.7 * time)
    assert lag_ms(true, np.roll(true, 6)) == pytest.approx(24.0)
    assert fit(true, true) == 100.0
    assert fit(true, np.full_like(true, true.mean())) == pytest.approx(0.0, abs=1e-9)
    assert np.abs(lowpassed(np.sin(2.0 * np.pi * 20.0 * time), 1.0)[500:-500]).max() < 0.01  # apart from its ends


def test_the_design_agrees_with_every_sentence_of_the_paper_on_it():
    sections = frequency.sections(design_from_toml(no_delay(), str(SPEC)))
    assert [section.figures for section in sections] == ["Figure 7", "Figure 8", "Figure 9", "Figure 10"]
    assert all(number.agrees for section in sections for number in section.numbers)


@pytest.mark.proof
def test_the_page_is_what_the_command_prints(tmp_path):
    assert (ROOT / "docs" / "paper.md").read_text("utf-8") == page(make(tmp_path)), "run `python -m docs.paper`"
