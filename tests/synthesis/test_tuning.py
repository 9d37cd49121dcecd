"""Tuning on the paper's pitch axis against the paper's own weights, and at the edges of what can be had."""

import re
from dataclasses import replace
from pathlib import Path

import control as ct
import numpy as np
import pytest

from dob_companion.cli.main import main
from dob_companion.comparison.flight import expect
from dob_companion.comparison.vehicle import Vehicle, close, no_observer
from dob_companion.errors import SpecError, UnsolvableError
from dob_companion.lti.gramian import gramian
from dob_companion.report.design_page import design_page
from dob_companion.synthesis import design_from_toml, parse_spec, synthesize
from dob_companion.synthesis.plant.models import from_data
from dob_companion.synthesis.tune import together
from dob_companion.synthesis.tune import tuning as tuning_module
from dob_companion.synthesis.tune.tuning import Task, designed_and_tuned, tuned_design_from_toml
from dob_companion.synthesis.tune.written import tuned_spec
from dob_companion.synthesis.tune.yardstick import Yardstick
from tests.synthesis import paper

EXAMPLE = (Path(__file__).parents[2] / "examples" / "tailsitter_auto.toml").read_text(encoding="utf-8")
PITCH = EXAMPLE[: EXAMPLE.index('[[block]]\nname = "roll"')].replace("in_correction = 1e-3", "in_correction = 1.8e-4")
"""With no more noise in the correction than the paper's weights let through."""


@pytest.fixture(scope="module")
def pitch():
    """The example's pitch axis, tuned: (design, its tuning)."""
    design, (tuning,) = tuned_design_from_toml(PITCH, "auto.toml")
    return design, tuning


def auto_with(old, new):
    assert old in PITCH
    return PITCH.replace(old, new, 1)


def tuned(spec, auto=None):
    return designed_and_tuned(Task(spec.blocks[0], spec.dt, auto or spec.auto))[1]


def complaint(text):
    with pytest.raises(SpecError) as caught:
        parse_spec(text, "auto.toml")
    assert str(caught.value).startswith("auto.toml: auto")
    return str(caught.value)


def test_it_beats_the_papers_weights_at_no_less_margin_and_no_more_noise(pitch):
    _, tuning = pitch
    assert tuning.own.disk_margin == pytest.approx(0.38117, abs=1e-4)
    assert tuning.chosen.disk_margin >= tuning.own.disk_margin
    assert tuning.chosen.noise <= tuning.own.noise
    assert tuning.chosen.attenuation > 1.9 * tuning.own.attenuation


def test_what_was_chosen_is_what_the_certificate_says(pitch):
    design, tuning = pitch
    (block,) = design.blocks
    assert block.certificate.disk_margin == pytest.approx(tuning.chosen.disk_margin, rel=1e-6)
    assert block.certificate.slowest_mode_s == pytest.approx(tuning.chosen.slowest_s, rel=1e-6)
    assert block.certificate.disk_margin >= 0.3812
    assert block.certificate.gamma_star == pytest.approx(1.0, abs=1e-3)


def test_in_the_papers_weather_it_flies_better_than_the_papers_weights_also_off_nominal(pitch):
    design, _ = pitch
    tuned = from_data(design.blocks[0].observer, paper.DT)
    theirs = synthesize(paper.PLANT, paper.PID, paper.W_D, paper.W_N).observer
    nominal = Vehicle(paper.PLANT, paper.PID, 1)
    for vehicle in (nominal, nominal.with_gain(0.7), nominal.with_gain(1.3), nominal.with_delay(1)):
        flown = [expect(close(vehicle, observer), 0.02).attitude for observer in (tuned, theirs)]
        assert flown[0] < flown[1]
    off = expect(close(nominal, no_observer(paper.DT)), 0.02).attitude
    assert off / expect(close(nominal, tuned), 0.02).attitude > 14.0


def test_more_margin_or_less_noise_costs_attenuation(pitch):
    _, tuning = pitch
    margins = [row for row in tuning.rows if row.asked.noise == tuning.asked.noise]
    gained = [row.found.attenuation for row in margins]
    assert len(gained) >= 4
    assert gained == sorted(gained, reverse=True)
    assert all(row.asked.excess(row.found) == 0.0 for row in tuning.rows)
    assert "the disk margin" in tuning.limited_by


def test_the_yardstick_agrees_with_the_closed_loop():
    spec = parse_spec(PITCH)
    observer = synthesize(paper.PLANT, paper.PID, paper.W_D, paper.W_N).observer
    measured = Yardstick(paper.PLANT, paper.PID, (1,), spec.auto).measure(observer)
    vehicle = Vehicle(paper.PLANT, paper.PID, 1)
    hertz = np.geomspace(1e-3, 124.9, 600)
    shape = 1.0 / ((1.0 + (0.1 / hertz) ** 4) * (1.0 + (hertz / 3.0) ** 4))
    power = []
    for around in (no_observer(paper.DT), observer):
        theta = _part(close(vehicle, around), 4, 0)
        gain = np.abs(ct.frequency_response(theta, 2.0 * np.pi * hertz).frdata[0, 0])
        power.append(np.trapezoid(gain**2 * shape, hertz))
    assert measured.attenuation == pytest.approx(np.sqrt(power[0] / power[1]), rel=2e-3)
    heard = _part(close(vehicle, observer, attitude=False), 2, 1)
    noise = heard.C @ gramian(heard.A, heard.B) @ heard.C.T + heard.D @ heard.D.T
    assert measured.noise == pytest.approx(3.981e-4 * float(np.sqrt(noise[0, 0])), rel=1e-6)
    assert measured.disk_margin == pytest.approx(0.38117, rel=2e-3)


def _part(loop, output, source):
    return ct.minreal(loop[output, source], verbose=False)


@pytest.mark.parametrize("delay", [0, 1, 2, 3])
def test_the_yardsticks_delay_margin_is_the_certificates_between_whole_samples(delay):
    found = synthesize(paper.PLANT, paper.PID, paper.W_D, paper.W_N, delay_samples=delay)
    measured = Yardstick(paper.PLANT, paper.PID, (delay,), parse_spec(PITCH).auto).measure(found.observer)
    assert int(measured.delay_margin) == found.certificate.delay_margin_samples


def test_the_yardstick_in_a_low_passs_weather_is_the_lyapunov_equations():
    spec = parse_spec(auto_with("disturbance_band_hz = [0.1, 3.0] ", "disturbance_corner_hz = 1.0 "))
    observer = synthesize(paper.PLANT, paper.PID, paper.W_D, paper.W_N).observer
    vehicle = Vehicle(paper.PLANT, paper.PID, 1)
    off, on = (expect(close(vehicle, o), 1.0).attitude for o in (no_observer(paper.DT), observer))
    measured = Yardstick(paper.PLANT, paper.PID, (1,), spec.auto).measure(observer)
    assert measured.attenuation == pytest.approx(off / on, rel=2e-3)
    assert spec.auto.disturbances == "disturbances through a 1 Hz low-pass"


@pytest.mark.proof
def test_a_delay_margin_that_is_asked_for_is_kept_and_costs_attenuation(pitch):
    auto = "least_delay_margin_samples = 4\nleast_disk_margin"
    design, (tuning,) = tuned_design_from_toml(auto_with("least_disk_margin", auto), "auto.toml")
    assert design.blocks[0].certificate.delay_margin_samples >= 4
    assert tuning.chosen.attenuation < pitch[1].chosen.attenuation
    assert "the delay margin" in tuning.limited_by


@pytest.mark.proof
def test_coupled_axes_are_tuned_together():
    text = PITCH[: PITCH.index("[[block]]")] + (
        '[[block]]\nname = "lateral"\naxes = ["roll", "yaw"]\n'
        '[[block.plant.entry]]\nfrom = "roll"\nto = "roll"\nzeros = [-1.716]\npoles = [1.0, 0.9447]\ngain = 0.084786\n'
        '[[block.plant.entry]]\nfrom = "yaw"\nto = "yaw"\nzeros = [-1.716]\npoles = [1.0, 0.9447]\ngain = 0.0494585\n'
        "[block.controller]\nA = []\nB = []\nC = []\nD = [[0.12, 0.0], [0.0, 0.2]]\n"
    )
    loose = "least_disk_margin = 0.5\nleast_delay_margin_samples = 0"  # so slow a baseline leaves no delay beside it
    spec = parse_spec(re.sub("least_disk_margin = 0.3812.*", loose, text))
    tuning = tuned(spec)
    assert tuning.chosen.disk_margin >= 0.5
    assert tuning.chosen.attenuation > 3.0
    assert len(tuning.noise) == 2


def over_gains(found):
    """Attenuation over the gains, as what is made best."""
    return np.mean(np.array([found.attenuation, *found.at_gains]) ** -2.0) ** -0.5


def two_coupled(more=""):
    """Two axes of the paper's dynamics behind a mixer, and what is asked of pitch."""
    mixer = ((1.0, 0.15), (0.1, 1.0))
    lines = [f'[[block]]\nname = "both"\naxes = ["roll", "pitch"]\n{more}']
    for i, to in enumerate(("roll", "pitch")):
        for j, source in enumerate(("roll", "pitch")):
            head = f'[[block.plant.entry]]\nfrom = "{source}"\nto = "{to}"'
            lines.append(f"{head}\nzeros = [-1.716]\npoles = [1.0, 0.9447]\ngain = {0.14131 * mixer[i][j]}")
        head = f'[[block.controller.entry]]\nfrom = "{to}"\nto = "{to}"'
        lines.append(f"{head}\nzeros = [0.8343, 0.9987]\npoles = [0.0, 1.0]\ngain = 0.9002")
    return PITCH[: PITCH.index("[[block]]")] + "\n".join(lines) + "\n"


@pytest.mark.proof
def test_more_states_make_coupled_axes_better_where_the_spec_allows_them(monkeypatch):
    monkeypatch.setattr(together._Choice, "rows", lambda *_: ())
    four, six = (tuned(parse_spec(two_coupled(more))) for more in ("", "largest_order = 12\n"))
    assert (four.order, six.order) == (8, 12)
    assert over_gains(six.chosen) > over_gains(four.chosen)
    assert six.asked.excess(six.chosen) == 0.0


@pytest.mark.proof
def test_coupled_axes_attenuate_within_their_limits_and_the_written_weights_give_the_observer_again():
    text = two_coupled()
    design, (tuning,) = tuned_design_from_toml(text, "both.toml")
    proof = design.blocks[0].certificate
    assert proof.disk_margin >= parse_spec(text).auto.least_disk_margin
    assert proof.gamma <= 1.0003 * proof.gamma_star
    assert tuning.chosen.attenuation > 10.0
    assert len(tuning.rows) >= 4
    assert all(row.asked.excess(row.found) == 0.0 and row.found.attenuation < row.limit for row in tuning.rows)
    assert 0.8 < tuning.chosen.attenuation / tuning.limit < 1.0
    for stricter in tuning.rows:
        looser = [row for row in tuning.rows if row.asked.excess(stricter.found) == 0.0]
        assert all(over_gains(row.found) >= over_gains(stricter.found) for row in looser)
    again = design_from_toml(tuned_spec(text, "both.toml", None, [tuning]))
    assert np.array_equal(again.blocks[0].observer.A, design.blocks[0].observer.A)


def test_limits_that_nothing_keeps_are_refused_with_the_one_in_the_way():
    spec = parse_spec(auto_with("least_disk_margin = 0.3812 ", "least_disk_margin = 1.9 "))
    with pytest.raises(
        UnsolvableError, match=r"block 'pitch': no observer .*without observer .*0\.893.*way: disk margin"
    ):
        tuned(spec)


def test_an_attitude_loop_that_is_unstable_by_itself_is_named():
    spec = parse_spec(PITCH)
    with pytest.raises(UnsolvableError, match="attitude loop"):
        tuned(spec, replace(spec.auto, attitude_gain=200.0))


def test_a_noise_density_becomes_its_rms_at_the_rate():
    spec = parse_spec(auto_with("noise_rms = 3.981e-4", "noise_density = 3.561e-5"))
    assert spec.auto.noise_rms == pytest.approx(3.981e-4, rel=1e-3)


def test_an_unknown_key_of_auto_names_the_nearest_one():
    message = complaint(auto_with("least_disk_margin", "least_disc_margin"))
    assert "unknown key 'least_disc_margin'; did you mean 'least_disk_margin'?" in message


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("[0.1, 3.0]", "[3.0, 0.1]", "0 < low < high < 125 Hz"),
        ("[0.1, 3.0]", "[0.1, 200.0]", "0 < low < high < 125 Hz"),
        ("noise_rms = 3.981e-4", "noise_rms = nan", "noise_rms: expected a positive number"),
        ("noise_rms = 3.981e-4", "", "noise_density (rad/s/√Hz) or noise_rms (rad/s)"),
        ("noise_rms = 3.981e-4", "noise_rms = 1e-4\nnoise_density = 1e-5", "one of them"),
        ("least_disk_margin = 0.3812", "least_disk_margin = 2.5", "between 0 and 2"),
        ("least_disk_margin = 0.3812", "", "'least_disk_margin' is missing"),
        (
            "noise_rms = 3.981e-4",
            "disturbance_corner_hz = 1.0\nnoise_rms = 3.981e-4",
            "expected one of disturbance_corner_hz, disturbance_band_hz",
        ),
        ("disturbance_band_hz = [0.1, 3.0]", "disturbance_corner_hz = 60.0", "between 0 and 41.6667 Hz"),
        ("least_disk_margin", "least_delay_margin_samples = 1.5\nleast_disk_margin", "whole number of 0 or more"),
        ("least_disk_margin", "gains = [0.7, -1.3]\nleast_disk_margin", "gains: expected at most 8 factors"),
        ("least_disk_margin", "disturbance_rms = 0.0\nleast_disk_margin", "disturbance_rms: expected a positive"),
        ("disturbance_band_hz = [0.1, 3.0]", "disturbance_dryden = { wind_m_s = 8.0 }", "'length_m' is missing"),
        ("disturbance_band_hz = [0.1, 3.0]", 'disturbance_spectrum = "wind.csv"', "text alone cannot name files"),
        (
            "disturbance_band_hz = [0.1, 3.0]",
            "disturbance_spectrum = { hz = [1.0, 0.5], power = [1.0, 1.0] }",
            "rising frequencies between 0 and 125 Hz",
        ),
    ],
)
def test_a_bad_value_of_auto_says_what_was_expected(old, new, expected):
    assert expected in complaint(auto_with(old, new))


def test_weights_may_be_left_out_only_where_they_are_to_be_found(tmp_path, capsys):
    bare = PITCH[: PITCH.index("# Weights may")]
    (spec := tmp_path / "auto.toml").write_text(bare, encoding="utf-8")
    assert main(["design", str(spec), "-o", str(tmp_path / "out")]) == 2
    assert "block 'pitch': key 'weights' is missing" in capsys.readouterr().err
    (plain := tmp_path / "plain.toml").write_text(paper.spec_text(), encoding="utf-8")
    assert main(["design", str(plain), "--auto", "-o", str(tmp_path / "out")]) == 2
    assert "plain.toml: key 'auto' is missing" in capsys.readouterr().err


def test_the_spec_with_its_weights_gives_the_same_observer_to_the_last_bit(pitch):
    design, tuning = pitch
    text = tuned_spec(PITCH, "auto.toml", None, (tuning,))
    (again,), (first,) = design_from_toml(text).blocks, design.blocks
    for name in "ABCD":
        assert np.array_equal(getattr(again.observer, name), getattr(first.observer, name))
    assert again.certificate.gamma == first.certificate.gamma


@pytest.mark.proof
def test_tuned_again_the_weights_are_the_same_to_the_last_bit(pitch):
    _, (tuning,) = tuned_design_from_toml(PITCH, "auto.toml")
    assert repr(tuning.disturbance) == repr(pitch[1].disturbance)
    assert repr(tuning.noise) == repr(pitch[1].noise)


@pytest.mark.proof
@pytest.mark.parametrize(
    ("stricter", "looser"),
    [("disk_margin = 0.3812", "disk_margin = 0.36"), ("correction = 1.8e-4", "correction = 1.9e-4")],
)
def test_asked_for_less_it_never_gives_less(pitch, stricter, looser):
    _, (tuning,) = tuned_design_from_toml(auto_with(stricter, looser), "auto.toml")
    assert _over_gains(tuning.chosen) >= _over_gains(pitch[1].chosen) * 0.999


def _over_gains(m):
    """What is made great: 1 / RMS over the gains of attitude error on / off."""
    return 1.0 / np.sqrt(np.mean(1.0 / np.array([m.attenuation, *m.at_gains]) ** 2))


@pytest.mark.parametrize(
    ("spectrum", "words"),
    [
        ("disturbance_dryden = { wind_m_s = 8.0, length_m = 5.0 }", "of Dryden gusts, 8 m/s and 5 m"),
        ("disturbance_spectrum = { hz = [0.1, 1.0, 10.0], power = [1, 1, 0.01] }", "of the measured spectrum"),
        ('disturbance_spectrum = "wind.csv"', "of the measured spectrum, 0.2 to 20 Hz"),
    ],
)
def test_a_spectrum_may_be_of_gusts_or_measured(spectrum, words):
    text = auto_with("disturbance_band_hz = [0.1, 3.0] ", f"{spectrum} ")
    auto = parse_spec(text, "auto.toml", {"wind.csv": b"Hz, power\n0.2, 4.0\n2, 4e-1\n20, 1e-3\n"}.__getitem__).auto
    assert words in auto.disturbances


def test_gains_and_a_largest_noise_gain_are_kept(pitch):
    text = auto_with("least_disk_margin", "gains = [1.0, 0.8]\nlargest_noise_gain = 0.8\nleast_disk_margin")
    text = text.replace("delay_samples = 1\n", "delay_samples = 1\nlargest_order = 4\n", 1)
    design, (tuning,) = tuned_design_from_toml(text, "auto.toml")
    assert design.blocks[0].certificate.extra["noise_to_estimate_peak"] <= 0.8
    assert len(tuning.chosen.at_gains) == 1
    assert tuning.chosen.attenuation <= pitch[1].chosen.attenuation * 1.03


def test_the_command_prints_the_weights_and_the_page_draws_the_trade_off(tmp_path, capsys, pitch, monkeypatch):
    """The tuning itself is the one that this file has made already."""
    monkeypatch.setattr(tuning_module, "tuned_design_from_toml", lambda *_, **__: (pitch[0], (pitch[1],)))
    (spec := tmp_path / "auto.toml").write_text(PITCH, encoding="utf-8")
    assert main(["design", str(spec), "--auto", "-o", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().out
    assert ">  chosen" in printed
    assert f"gain = {pitch[1].disturbance.gain!r}\n" in (tmp_path / "out" / "tuned.toml").read_text(encoding="utf-8")
    assert re.search(rf"the spec's own weights +{pitch[1].own.attenuation:.2f} ", printed)
    wide = [line for line in printed.splitlines() if len(line) > 80 and not line.startswith("written")]
    assert not wide
    assert 'id="b0-tradeoff' in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_the_page_of_a_design_without_tuning_has_no_trade_off(pitch):
    assert "b0-tradeoff" in design_page(pitch[0], (pitch[1],))
    assert "b0-tradeoff" not in design_page(pitch[0])


@pytest.mark.proof
def test_an_identified_axis_whose_reductions_rounding_spoils_gets_its_optimum():
    """ArduCopter's roll in its simulator, three samples of delay: reduced to the optimum's own states, gamma was 1.004
    of what it may be, or commands leaked, which was refused."""
    text = (Path(__file__).parents[1] / "data" / "ardupilot" / "copter_identified.toml").read_text(encoding="utf-8")
    (block,) = tuned_design_from_toml(text, "identified.toml")[0].blocks
    assert block.certificate.gamma <= 1.0003 * block.certificate.gamma_star
