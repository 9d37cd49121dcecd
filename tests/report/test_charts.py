"""Charts as data: peaks survive decimation, limits hold the data, marks stand where the flight says."""

import base64
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dob_companion.analysis.design import axis_responses
from dob_companion.report import design_charts, draw
from dob_companion.report.bode_charts import figure_8, figure_10
from dob_companion.report.chart import Chart, Curve, Mark, Panel, Scale, envelope, rounded, symmetric
from dob_companion.report.flight_charts import figure_13, still_air, switch_time, window_error
from dob_companion.report.words import number, transfer_function
from dob_companion.synthesis.certify.behaviour import Roots, gust_response, loops_of, open_loop, roots, step_response
from tests.report.material import coupled_design, paper_design, trace


@given(st.integers(2, 5000), st.integers(1, 400), st.integers(0, 2**32 - 1))
def test_decimation_keeps_order_ends_and_every_extreme(n, columns, seed):
    y = np.random.default_rng(seed).normal(size=n)
    x = np.arange(float(n))
    kept_x, kept_y = envelope(x, y, columns)
    assert np.all(np.diff(kept_x) > 0)
    assert (kept_x[0], kept_x[-1]) == (0.0, n - 1.0)
    assert (kept_y.min(), kept_y.max()) == (y.min(), y.max())
    np.testing.assert_array_equal(kept_y, y[kept_x.astype(int)])
    assert len(kept_x) <= max(2 * columns + 2, 2 * columns)


def test_limits_hold_the_data_and_ignore_what_is_not_finite():
    assert rounded([np.array([-13.0, np.inf]), np.array([7.0, np.nan])], 10.0) == (-20.0, 10.0)
    assert rounded([np.array([np.nan])], 10.0) == (0.0, 10.0)
    assert symmetric([np.array([-2.0, 1.0])], 1.0) == 2.0
    assert symmetric([np.zeros(3)]) == 1.0


def test_a_curve_of_unequal_lengths_is_refused():
    with pytest.raises(ValueError, match="expected equal lengths"):
        Curve("c", np.zeros(3), np.zeros(4), "on")


def test_embedded_data_is_the_curve_at_full_rate():
    y = np.sin(np.arange(9000.0))
    scale = Scale("x", "s", 0.0, 9000.0)
    panel = Panel(0, 0, scale, Scale("y", "", -1.0, 1.0), (Curve("c", np.arange(9000.0), y, "on"),), (), (Mark(x=5.0),))
    packed = json.loads(draw.data(Chart("k", "", (panel,))))["panels"][0]["curves"][0]["y"]
    np.testing.assert_allclose(np.frombuffer(base64.b64decode(packed), "<f4"), y, atol=1e-6)


def test_the_estimate_drawn_is_minus_the_correction():
    chart, rows = figure_13(trace()), trace().rows("on")
    pitch = next(panel for panel in chart.panels if panel.row == 1 and panel.col == 0)
    truth, estimate = pitch.curves
    np.testing.assert_array_equal(truth.y, trace().disturbance[rows, 1])
    np.testing.assert_array_equal(estimate.y, -trace().correction[rows, 1])


def test_the_switch_and_the_pause_are_found_in_the_flight():
    assert still_air(trace()) == pytest.approx((6.0, 7.996))
    assert switch_time(trace()) == pytest.approx(8.0, abs=0.005)


def test_window_errors_are_drawn_without_their_mean():
    np.testing.assert_allclose(window_error(trace(), "off").mean(axis=0), 0.0, atol=1e-15)


@pytest.mark.parametrize("figure", [figure_8, figure_10])
@pytest.mark.parametrize("design", [paper_design, coupled_design])
def test_responses_stay_under_the_bound_that_the_page_says_is_guaranteed(figure, design):
    for block in design().blocks:
        chart = figure("k", axis_responses(block, design().dt))
        bottom = max(panel.row for panel in chart.panels)
        for panel in (p for p in chart.panels if p.row == bottom):
            bound, reached = panel.curves
            assert bound.role == "bound"
            assert np.all(reached.y <= bound.y + 1e-6)


def test_the_open_loop_stays_out_of_the_disk_that_the_page_draws():
    block = paper_design().blocks[0]
    L = open_loop(loops_of(block, 0.004).on, 0, np.geomspace(0.01, 125.0, 3000), 0.004)
    a = block.certificate.disk_margin
    far, near = (2.0 + a) / (2.0 - a), (2.0 - a) / (2.0 + a)
    distance = np.abs(L + (far + near) / 2.0) / ((far - near) / 2.0)
    assert distance.min() == pytest.approx(1.0, abs=1e-3)  # it touches, and no more


def test_step_and_gust_end_where_the_observer_has_found_them():
    loops = loops_of(paper_design().blocks[0], 0.004)
    step, gust = step_response(loops, 0, 0.1), gust_response(loops, 0, 0.1)
    assert step.d_hat[0] == 0.0
    assert step.d_hat[-1] == pytest.approx(0.1, rel=0.03)
    assert abs(step.rate_on[-1]) < 0.05 * abs(step.rate_off[-1])
    assert gust.d.max() == pytest.approx(0.1, rel=1e-4)
    assert gust.d[-1] == 0.0


def test_a_model_is_written_with_the_roots_it_was_given():
    found = roots(paper_design().blocks[0].problem.controller, 0.004)
    written = transfer_function(found.zeros, found.poles, found.gain)
    assert written == "0.9002 (z − 0.9987)(z − 0.8343) / ((z − 1)z)"
    assert transfer_function([], [0.5 + 0.5j, 0.5 - 0.5j], -2.0) == "−2 / (z² − 1 z + 0.5)"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (1234.5678, "1235"),
        (-0.0123456, "−0.0123"),
        (1.3e-12, "1.30\u00a0·\u00a010⁻¹²"),
        (float("nan"), "–"),
        (float("inf"), "unlimited"),
    ],
)
def test_numbers_are_written_for_people(value, text):
    assert number(value) == text


@pytest.mark.parametrize("reach", [0.0, 1.9, 2.9])
def test_a_circle_in_the_complex_plane_is_one(reach):
    """As many pixels to the unit along either axis, and the whole unit circle in view."""
    zeros = Roots(np.array([-reach + 0j]), np.array([1.0 + 0j]), 1.0)
    curve = np.exp(1j * np.linspace(0.0, 3.0, 20))
    roots = design_charts.pole_zero_map("roots", zeros, zeros, curve)
    for chart in (roots, design_charts.nyquist("nyquist", np.arange(20.0), curve, curve, 0.4)):
        (panel,) = chart.panels
        _, _, width, height = draw.box(chart, panel)
        pixels = width / (panel.x.high - panel.x.low), height / (panel.y.high - panel.y.low)
        assert pixels[0] == pytest.approx(pixels[1], rel=1e-3)
        assert min(panel.x.high, panel.y.high, -panel.y.low, -panel.x.low) > 1.05


def test_numbers_beside_a_right_hand_axis_stay_clear_of_the_panel_at_its_left():
    x, fine = Scale("time", "s", 0.0, 1.0), Scale("error", "rad", -0.0005, 0.0005)
    panels = tuple(Panel(0, col, x, fine, (Curve("e", np.arange(2.0), np.zeros(2), "on"),)) for col in (0, 1))
    chart = Chart("two", "two panels", panels, 1000, 300, col_widths=(1.0, 1.0))
    left, right = (draw.box(chart, panel) for panel in panels)
    assert right[0] - (left[0] + left[2]) > 8 + 6 * len("−0.0004")
    assert left[0] > 8 + 6 * len("−0.0004")
