"""The comparison as a whole: the rule holds, the table tells, the page opens."""

import json
import re
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from dob_companion.cli.main import main
from dob_companion.comparison import OFF_NOMINAL, compare, comparison_object, comparison_table
from dob_companion.comparison.evaluate import expected_attenuation
from dob_companion.comparison.rational import NotApplicableError
from dob_companion.comparison.table import UNTUNED
from dob_companion.comparison.tuning import SLACK, Family, Judge, Knob, tune
from dob_companion.comparison.vehicle import no_observer
from dob_companion.errors import SpecError
from dob_companion.report.comparison_page import _overview, comparison_page, comparison_png
from dob_companion.synthesis import design_from_toml
from tests.comparison.conftest import SEEDS, pitch_text
from tests.comparison.test_flight import observer_of
from tests.synthesis.paper import DT

ALL = ["off", "hinf", "conventional", "open_loop", "kalman", "eso", "indi", "kalman_told", "open_loop_stated"]


def row(comparison, key):
    return next(r for r in comparison.rows if r.key == key)


def test_every_method_is_there_for_the_papers_axis(pitch):
    assert [r.key for r in pitch.rows] == ALL
    assert pitch.absent == ()


def test_all_tuned_methods_pay_no_less_than_the_rule_asks(pitch):
    price = row(pitch, "hinf")
    for r in pitch.rows:
        if r.tuned:
            assert r.noise_rms <= SLACK * price.noise_rms
            assert SLACK * r.disk_margin >= price.disk_margin
            assert all(value is not None for value in r.off_nominal.values())


def test_without_an_observer_nothing_is_attenuated(pitch):
    off = row(pitch, "off")
    assert off.attenuation == pytest.approx((1.0,) * SEEDS)
    assert off.peak == pytest.approx(0.12, rel=1e-6)


def test_what_the_rule_forbids_costs_what_the_references_say(pitch):
    """Told the truth, the Kalman filter lets gyro noise through up to +22 dB; as stated, the open-loop design more."""
    assert row(pitch, "kalman_told").noise_peak_db == pytest.approx(22.4, abs=1.0)
    stated = row(pitch, "open_loop_stated")
    assert stated.noise_peak_db > 60.0
    assert stated.off_nominal["gain +30 %"] is None


def test_the_best_is_the_one_with_the_most_attenuation(pitch):
    assert pitch.best.mean == max(r.mean for r in pitch.rows if r.tuned)
    assert f"most attenuation at the same price: {pitch.best.name}" in comparison_table(pitch)


def test_unstable_is_said_as_such(pitch):
    lines = [line for line in comparison_table(pitch).splitlines() if line.startswith("open-loop H∞, as stated")]
    assert sum(line.count("unstable") for line in lines) == 2


def test_the_table_fits_a_terminal_of_80_columns(pitch):
    assert max(map(len, comparison_table(pitch).splitlines())) <= 80


def test_a_loop_without_stability_has_no_attenuation(designs, vehicle):
    changed = dict(OFF_NOMINAL)["gain +30 %"](vehicle)
    assert np.array_equal(changed.plant.C, 1.3 * vehicle.plant.C)
    assert expected_attenuation(vehicle.with_gain(30.0), observer_of(designs[1]), 0.05) is None


def test_the_json_holds_the_tables_numbers(pitch):
    found = json.loads(json.dumps(comparison_object((pitch,)), allow_nan=False))
    methods = found["axes"]["pitch"]["methods"]
    assert list(methods) == ALL
    assert methods["hinf"]["attenuation_mean"] == pytest.approx(np.mean(methods["hinf"]["attenuation"]))
    assert methods["open_loop_stated"]["expected_attenuation"]["gain −30 %"] is None
    assert all(methods[key]["source"] for key in ALL[1:])
    lqg = found["axes"]["pitch"]["lqg"]
    assert lqg["design"]["disk_margin"] == pytest.approx(methods["hinf"]["disk_margin"])
    assert lqg["design"]["expected_attenuation"] == pytest.approx(methods["hinf"]["attenuation_mean"], rel=0.1)
    assert lqg["design"]["expected_attenuation"] < lqg["at_price"]["expected_attenuation"]
    assert lqg["at_price"]["expected_attenuation"] < lqg["bound"]["expected_attenuation"]


def test_the_search_finds_the_edge_that_the_rule_draws(designs, vehicle):
    """A known family: the design's own estimate scaled by a knob. The rule stops it at 1, its price."""
    observer = observer_of(designs[1])
    judge = Judge.by(vehicle, 0.05, observer)
    family = Family("scaled", (Knob("share", "", 0.01, 10.0, 12),), lambda share: share * observer)
    best = tune([family], judge)
    assert float(re.search(r"share ([\d.]+)", best.settings)[1]) == pytest.approx(1.0, abs=0.03)
    assert np.isinf(judge.attitude(1.1 * observer))


def test_a_family_that_always_breaks_the_rule_yields_nothing(designs, vehicle):
    observer = observer_of(designs[1])
    loud = Family("", (Knob("share", "", 2.0, 10.0, 5),), lambda share: share * observer)
    assert tune([loud], Judge.by(vehicle, 0.05, observer)) is None


def test_a_method_that_does_not_apply_says_why(designs, vehicle):
    def build(_):
        raise NotApplicableError("the plant lacks a tail")

    judge = Judge.by(vehicle, 0.05, observer_of(designs[1]))
    with pytest.raises(NotApplicableError, match="tail"):
        tune([Family("", (Knob("share", "", 1.0, 2.0, 3),), build)], judge)


def test_no_observer_is_within_every_rule(designs, vehicle):
    judge = Judge.by(vehicle, 0.05, observer_of(designs[1]))
    assert np.isfinite(judge.attitude(no_observer(DT)))


def test_methods_that_do_not_apply_are_listed_with_their_reason():
    text = pitch_text().replace("zeros = [-1.716]", "zeros = [-1.0]")
    found = compare(design_from_toml(text.replace("gain = 0.9002", "gain = 0.5")), 1, "spec.toml")[0]
    assert dict(found.absent)["open-loop H∞, low-passed"].endswith("without zeros on the unit circle")
    assert "none (the open-loop design needs" in comparison_table(found)


def test_coupled_axes_are_refused_by_name(designs):
    block = designs[1].blocks[0]
    coupled = pitch_text().replace('axes = ["pitch"]', 'axes = ["pitch", "roll"]')
    assert coupled != pitch_text()
    assert block.axes == ("pitch",)
    for kind in ("plant", "controller"):
        body = re.search(rf"\[block\.{kind}\][^\[]*\n(zeros.*\npoles.*\ngain.*)", coupled)[1]
        plain = "\n".join(line.split("#")[0] for line in body.splitlines())
        entries = "".join(f'[[block.{kind}.entry]]\nfrom = "{a}"\nto = "{a}"\n{plain}\n' for a in ("pitch", "roll"))
        coupled = coupled.replace(body, "").replace(f"[block.{kind}]", f"{entries}#", 1)
    with pytest.raises(SpecError, match=r"^spec.toml: block 'pitch': axes: .* one axis"):
        compare(design_from_toml(coupled), 1, "spec.toml")


def test_the_page_is_whole_and_says_what_the_table_says(pitch):
    page = comparison_page((pitch,), "a <spec>.toml")
    assert "a &lt;spec&gt;.toml" in page
    assert not re.search(r'(src|href)="(https?:)?//', page)
    assert re.findall(r'data-method="(\w+)"', page) == ALL
    for r in pitch.rows:
        assert f"{r.mean:.2f} ± {r.spread:.2f}" in page
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))


def test_the_picture_is_a_png_of_1600_pixels(pitch):
    data = comparison_png(pitch)
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert int.from_bytes(data[16:20], "big") == 1600


def test_the_command_prints_the_table_and_writes_what_it_says(tmp_path, capsys, monkeypatch, designs, pitch):
    """The comparison itself is the one that this file has made already."""
    monkeypatch.setattr("dob_companion.synthesis.design_from_toml", lambda *_, **__: designs[1])
    monkeypatch.setattr("dob_companion.comparison.compare", lambda *asked: [pitch] * (asked[1] == SEEDS))
    spec, out = tmp_path / "pitch.toml", tmp_path / "out"
    spec.write_text(pitch_text(), encoding="utf-8")
    assert main(["compare", str(spec), "-o", str(out), "--seeds", str(SEEDS), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((out / "comparison.json").read_text(encoding="utf-8"))
    assert len(printed["axes"]["pitch"]["methods"]["hinf"]["attenuation"]) == SEEDS
    assert sorted(p.name for p in out.iterdir()) == ["comparison.html", "comparison.json", "comparison.png"]


@pytest.mark.parametrize("seeds", ["0", "-1", "1001"])
def test_a_number_of_flights_that_cannot_be_is_refused(seeds, tmp_path, capsys):
    assert main(["compare", str(tmp_path / "none.toml"), "--seeds", seeds]) == 2
    assert "--seeds" in capsys.readouterr().err


@pytest.mark.parametrize("factor", [1.0, 0.5, 0.2])
def test_in_the_picture_no_words_lie_on_others_or_leave_their_axes(pitch, factor):
    """Also where the words on what is unstable have no room at the left, as with attenuations a fifth as large."""
    rows = tuple(
        replace(
            r,
            attenuation=tuple(factor * a for a in r.attenuation),
            off_nominal={name: a and factor * a for name, a in r.off_nominal.items()},
        )
        if r.key == "open_loop_stated"
        else r
        for r in pitch.rows
    )
    drawn = _overview(replace(pitch, rows=rows))
    drawn.canvas.draw()
    for axes in drawn.axes:
        area = axes.get_window_extent()
        boxes = [text.get_window_extent() for text in axes.texts if text.get_text() != UNTUNED]
        assert all(area.x0 <= box.x0 and box.x1 <= area.x1 for box in boxes)
        dots = [line.get_window_extent() for line in axes.lines if line.get_marker() == "o" and len(line.get_xdata())]
        assert all(area.x0 <= dot.x0 and dot.x1 <= area.x1 for dot in dots)
        assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))
