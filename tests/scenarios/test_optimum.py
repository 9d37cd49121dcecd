"""docs/optimum.md: its arithmetic, and whether the code still gives its numbers."""

import re

import pytest

from dob_companion.comparison.shortfall import NO_LINK, Shortfall, Step
from tests.scenarios.optimum import Case, Flown, Found, design_of, find
from tests.scenarios.optimum_page import PAGE, cost_row, flight_row, page, strength_row

NUMBER = re.compile(r"−?\d+(?:\.\d+)?(?: %)?")


def expected(attenuation: float, at_price: float) -> Shortfall:
    steps = (
        Step(NO_LINK, 1.5 * at_price),
        Step("best with any noise", 3.0 * at_price),
        Step("best with any disk margin", 1.25 * at_price),
    )
    design = Step("this design", attenuation, 0.4, 3e-4, 2)
    return Shortfall(0.06, design, Step("best at this price", at_price, 0.4, 3e-4, 1), Step("bound", 700.0), steps)


def test_a_row_sets_the_median_flight_against_the_optimum_in_the_same_flight():
    tuned, paper = Flown((0.06, 0.05, 0.07), (0.005, 0.005, 0.005)), Flown((0.06, 0.05, 0.07), (0.01, 0.01, 0.01))
    assert tuned.ratios == pytest.approx((12.0, 10.0, 14.0))
    flown = {Case("paper", 1.0, "tuned", 1, "pitch"): tuned, Case("paper", 1.0, "paper", 1, "pitch"): paper}
    both = {("tuned", 1, "pitch"): expected(12.5, 15.0), ("paper", 1, "pitch"): expected(6.5, 11.0)}
    row = flight_row(Found(flown, both), "paper", "pitch", 1)
    assert row == (
        "| pitch | 1 | 60.0 | 6.0, 6.5 | 5.00 | **12.0** (10.0 to 14.0) | 12.5 | 4.00, 15.0 | 700 | 20 %, 25 % | 12 |"
    )


def test_the_costs_are_what_the_optimum_gains_when_one_thing_changes():
    row = cost_row("pitch", 1, expected(12.5, 15.0))
    assert row == "| pitch | 1 | 0.400, 3.00e−4 | **20 %** | 2, 1 | 3.00 | 1.25 | 1.50 |"


def test_what_the_vehicle_costs_is_told_from_what_noise_costs():
    ratios = {
        ("paper", 0.5): 14.0,
        ("paper", 1.0): 16.0,
        ("paper_nonlinear", 0.5): 14.0,
        ("paper_nonlinear", 1.0): 12.0,
    }
    flown = {Case(s, size, "tuned", 1, "yaw"): Flown((ratio,), (1.0,)) for (s, size), ratio in ratios.items()}
    assert strength_row(Found(flown, {}), "yaw", 1) == "| yaw | 1 | 14.0 | 16.0 | 14.0 | 12.0 | 1.00, 0.75 |"


def test_the_spec_for_no_link_keeps_its_margins():
    blocks = design_of("tuned", 0).blocks
    assert {block.axes for block in blocks} == {("roll",), ("pitch",), ("yaw",)}
    for block in blocks:
        assert block.delay_samples == 0
        assert block.certificate.disk_margin >= 0.38
        assert block.certificate.delay_margin_samples >= 2


@pytest.mark.proof
def test_the_page_shows_what_the_flights_and_the_optimum_come_to():
    written, now = PAGE.read_text("utf-8"), page(find())
    print(now)
    assert NUMBER.sub("#", written) == NUMBER.sub("#", now), "older than the code: --write"
    for before, after in zip(NUMBER.findall(written), NUMBER.findall(now), strict=True):
        assert value(after) == pytest.approx(value(before), rel=0.02, abs=1.01 if "%" in before else 0.011), before


def value(text: str) -> float:
    return float(text.removesuffix(" %").replace("−", "-"))
