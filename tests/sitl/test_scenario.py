"""Scenario files and the search for the disturbance."""

from dataclasses import replace

import pytest

from sitl.calibration import disturbance_scale, peaks_off
from sitl.errors import FlightFailedError, ScenarioError
from sitl.scenario.spec import load, packaged_names
from tests.sitl.bench import SHORT, short_scenario


def test_every_packaged_scenario_loads_by_name_and_says_what_it_is():
    assert {"calm", "paper"} <= set(packaged_names())
    for name in packaged_names():
        scenario = load(name)
        assert scenario.name == name
        assert len(scenario.title) > 10


def test_the_paper_s_scenario_is_the_paper_s():
    paper = load("paper")
    assert paper.disturbance.peak_attitude_error == (0.15, 0.12, 0.12)
    assert paper.disturbance.bandwidth_hz == 1.0
    assert paper.noise_dbw == -68.0
    assert paper.paper_ratio == pytest.approx((0.15 / 0.02, 0.12 / 0.01, 0.12 / 0.02))
    assert (paper.windows.lead_s, paper.windows.length_s) == (2.0, 30.0)


def test_a_scenario_is_found_by_path(tmp_path):
    assert load(short_scenario(tmp_path)).name == "short"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("noise_dbw", "noise_dbv", "gyro.noise_dbw.*'noise_dbv' is unknown, did you mean 'noise_dbw'"),
        ("[gyro]", "extra = 1\n[gyro]", "extra: unknown key"),
        ("lead_s = 0.2", "lead_s = 0.2\nlead = 1", "windows.lead: unknown key; did you mean 'lead_s'"),
        ("roll = 0.15, ", "", "disturbance.peak_attitude_error_rad.roll: expected a number from"),
        ("noise_dbw = -68.0", "noise_dbw = nan", "gyro.noise_dbw: expected a number"),
        ("noise_dbw = -68.0", "noise_dbw = true", "gyro.noise_dbw: expected a number"),
        ("noise_dbw = -68.0", 'noise_dbw = "low"', "gyro.noise_dbw: expected a number"),
        ("length_s = 1.0", "length_s = -1.0", "windows.length_s: expected a number from"),
        ('title = "short"', "title = 3", "title: expected text"),
        ("[gyro]\n", "gyro = 3\n[other]\n", "gyro: expected a table"),
        ("[paper_ratio]", "[paper_ratios]", "paper_ratios: unknown key; did you mean 'paper_ratio'"),
        ("title", "title = = ", "not TOML"),
        ("[disturbance]", '[disturbance]\nacts_as = "moment"', "disturbance.acts_as: a moment needs a body"),
        ("hover_altitude_m = ", f"hover_altitude_m = {5000 * '9'}\nother = ", "not TOML"),
        ("hover_altitude_m = ", f"deep = {3000 * '['}", "not TOML"),
    ],
)
def test_a_bad_scenario_is_named_with_file_and_key(tmp_path, old, new, message):
    path = tmp_path / "bad.toml"
    assert old in SHORT
    path.write_text(SHORT.replace(old, new, 1))
    with pytest.raises(ScenarioError, match=message) as error:
        load(str(path))
    assert "bad.toml" in str(error.value)
    assert "\n" not in str(error.value)


def test_windows_without_a_disturbance_are_refused(tmp_path):
    path = tmp_path / "half.toml"
    path.write_text(SHORT[: SHORT.index("[disturbance]")] + SHORT[SHORT.index("[windows]") :])
    with pytest.raises(ScenarioError, match="come together"):
        load(str(path))


def test_an_unknown_scenario_names_the_nearest_one():
    with pytest.raises(ScenarioError, match="did you mean 'paper'"):
        load("papper")


def test_a_file_that_is_not_there_is_named():
    with pytest.raises(ScenarioError, match=r"nowhere\.toml"):
        load("nowhere.toml")


@pytest.mark.parametrize("seed", [1, 5])
def test_the_disturbance_found_gives_the_peaks_of_the_paper(seed):
    paper = load("paper")
    scale = disturbance_scale(paper, seed)
    assert peaks_off(paper, seed, scale) == pytest.approx((0.15, 0.12, 0.12), rel=1e-5)
    assert all(0.01 < s < 0.5 for s in scale)


def test_still_air_needs_no_search():
    assert disturbance_scale(load("calm"), 1) == (0.0, 0.0, 0.0)


def test_peaks_beyond_the_torque_there_is_are_refused(tmp_path):
    path = tmp_path / "storm.toml"
    path.write_text(SHORT.replace("pitch = 0.12", "pitch = 0.99"))
    with pytest.raises(FlightFailedError, match="smaller"):
        disturbance_scale(load(str(path)), 1)


def test_linear_axes_have_no_body_for_a_moment_to_act_on():
    with pytest.raises(FlightFailedError, match="rod: its disturbance is a moment on the body"):
        disturbance_scale(replace(load("rod"), airframe="linear"), 1)


def test_a_disturbance_is_made_no_stronger_than_the_scenario_allows(tmp_path):
    """The axis that needs most gets less than it needs; the others come to their peaks."""
    path = tmp_path / "held.toml"
    path.write_text(SHORT)
    free = disturbance_scale(load(str(path)), 1)
    limit = 0.9 * max(free)
    path.write_text(SHORT.replace("[windows]", f"largest_rms = {limit}\n[windows]"))
    held = load(str(path))
    scale = disturbance_scale(held, 1)
    assert scale == pytest.approx([min(each, limit) for each in free], rel=0.02)
    peaks = peaks_off(held, 1, scale)
    for found, wanted, needed in zip(peaks, (0.15, 0.12, 0.12), free, strict=True):
        assert found < 0.99 * wanted if needed > limit else found == pytest.approx(wanted, rel=1e-5)
