"""Uncertain plants: what may be written, what is proved, and that no plant of the set does worse than the proof."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dob_companion.artifact import dumps, loads
from dob_companion.cli.robustness import robustness_words
from dob_companion.comparison.flight import expect
from dob_companion.comparison.vehicle import close, no_observer
from dob_companion.errors import NotConvergedError, SpecError, UnsolvableError
from dob_companion.lti.response import response, spectral_radius
from dob_companion.report.design_page import design_page
from dob_companion.report.robust_chart import robust_claims
from dob_companion.synthesis import design_from_toml, parse_spec, synthesize, verify, zpk
from dob_companion.synthesis.norms.hinf import hinf_norm
from dob_companion.synthesis.optimal.problem import Axis, Spectrum
from dob_companion.synthesis.optimal.search import Search
from dob_companion.synthesis.plant.loop import close_loop
from dob_companion.synthesis.plant.models import from_data, stack
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.robust.analysis import FACTOR_STEP, GUARD, analyse, error_of
from dob_companion.synthesis.robust.bands import robust_bands
from dob_companion.synthesis.robust.cells import Sample, disks, factor_system, first_cells, mode_root, samples
from dob_companion.synthesis.robust.destabilize import all_pass, band_pass, destabilized
from dob_companion.synthesis.robust.interconnection import interconnect
from dob_companion.synthesis.robust.programme import factors
from dob_companion.synthesis.spec.spectrum import LowPass
from dob_companion.synthesis.spec.uncertainty import ChannelUncertainty, Interval, Mode, Uncertainty, parse_uncertainty
from dob_companion.toml import Table
from tests.effort import examples
from tests.synthesis.optimal.axes import vehicle_of, weather_of
from tests.synthesis.paper import DT, PID, PLANT, W_D, W_N

SPEC = Path(__file__).parents[2] / "examples" / "robust_pitch.toml"
ANGLES = np.linspace(0.0, np.pi, 200)

GAIN = ChannelUncertainty(gain=Interval(1.0, 0.7, 1.3))
GAIN_POLE = replace(GAIN, poles=(Interval(0.9447, 0.93, 0.96),))
BOUND = ChannelUncertainty(frequency_hz=(0.0, 10.0, 50.0), multiplicative=(0.1, 0.2, 0.6))
MIXED = replace(GAIN_POLE, frequency_hz=(0.0, 50.0), multiplicative=(0.02, 0.1))
RESONANT = ChannelUncertainty(
    gain=Interval(1.0, 0.9, 1.1), modes=(Mode(Interval(30, 29, 31), Interval(0.1, 0.09, 0.12)),)
)


@pytest.fixture(scope="module")
def nominal():
    return synthesize(PLANT, PID, W_D, W_N, delay_samples=1)


@pytest.fixture(scope="module")
def robust():
    return design_from_toml(SPEC.read_text(encoding="utf-8"), "robust_pitch.toml")


@pytest.fixture(scope="module")
def scaled():
    """The same without [auto]: only weights are known."""
    text = SPEC.read_text(encoding="utf-8")
    return design_from_toml(text[: text.index("[auto]")] + text[text.index("[[block]]") :])


def one(channel):
    return Uncertainty((channel,))


def flexible():
    """The paper's plant with a lightly damped mode beside it, and its observer."""
    root = mode_root(30.0, 0.1, DT)
    plant = PLANT * zpk(
        [mode_root(33.0, 0.15, DT), mode_root(33.0, 0.15, DT).conjugate()], [root, root.conjugate()], 1.0, DT
    )
    return synthesize(plant, 0.5 * PID, W_D, W_N, delay_samples=1)


# --- what may be written ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("raw", "said"),
    [
        ({"gian": [0.7, 1.3]}, "unknown key 'gian'; did you mean 'gain'?"),
        ({"gain": [1.1, 1.3]}, "gain: expected [low, high] around 1, got [1.1, 1.3]"),
        ({"gain": [0.0, 1.3]}, "gain: expected a range above 0"),
        ({"pole": {"nominal": 0.9, "rang": [0.8, 0.95]}}, "unknown key 'rang'; did you mean 'range'?"),
        ({"pole": {"nominal": 0.9, "range": [0.8, 1.0]}}, "expected inside (-1, 1)"),
        ({"modes": [{"frequency_hz": 20.0, "damping": 0.02, "range_hz": [21.0, 22.0]}]}, "around 20"),
        ({"modes": [{"frequency_hz": 20.0, "damping": 1.5}]}, "damping: expected a ratio between 0 and 1"),
        ({"delay_samples": [1, 2]}, "delay_samples: expected [0, most]"),
        ({"frequency_hz": [1.0, 2.0], "multiplicative": [0.1]}, "multiplicative: 1 values"),
        ({"frequency_hz": [2.0, 1.0], "multiplicative": [0.1, 0.1]}, "frequency_hz: expected rising"),
        ({"synthesis": "robsut", "gain": [0.7, 1.3]}, "synthesis: expected one of robust, nominal"),
        ({"synthesis": "robust"}, "nothing is uncertain"),
        ({"gain": [1.0, 1.0]}, "nothing is uncertain"),
    ],
)
def test_a_complaint_names_the_key_and_what_was_expected(raw, said):
    with pytest.raises(SpecError) as caught:
        parse_uncertainty(Table("block 'pitch': uncertainty", raw), ("pitch",))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("block 'pitch': uncertainty")


def test_an_axis_may_have_an_uncertainty_of_its_own():
    raw = {"gain": [0.7, 1.3], "pitch": {"delay_samples": [0, 2]}}
    found = parse_uncertainty(Table("u", raw), ("roll", "pitch"))
    assert found.channels == (GAIN, ChannelUncertainty(most_delay=2))


def test_an_uncertainty_reads_back_as_it_was_written():
    whole = Uncertainty((MIXED, replace(RESONANT, most_delay=3)), "nominal")
    assert parse_uncertainty(Table("u", whole.to_object(("roll", "yaw"))), ("roll", "yaw")) == whole


def test_a_misspelt_key_in_a_spec_is_answered_with_the_nearest():
    text = SPEC.read_text(encoding="utf-8").replace("delay_samples = [0, 1]", "delay_sample = [0, 1]")
    with pytest.raises(
        SpecError, match=r"x.toml: block 'pitch': uncertainty: unknown key 'delay_sample'.*delay_samples"
    ):
        parse_spec(text, "x.toml")


def test_an_uncertain_pole_must_be_one_of_the_plant(nominal):
    stranger = ChannelUncertainty(poles=(Interval(0.8, 0.7, 0.9),))
    with pytest.raises(SpecError, match=r"pole 0.8 .*expected a pole of the plant; the nearest is 0.9447"):
        analyse(nominal.problem, nominal.observer, one(stranger))


# --- the cover -------------------------------------------------------------------------------------------------------


@settings(max_examples=examples(30), deadline=None)
@given(
    gain=st.floats(0.0, 0.9),
    pole=st.floats(-0.9, 0.9),
    reach=st.floats(0.0, 0.05),
    hertz=st.floats(2.0, 110.0),
    wide=st.floats(0.0, 0.2),
    seed=st.integers(0, 2**32 - 1),
)
def test_every_plant_of_a_cell_lies_in_its_disk_at_every_frequency(gain, pole, reach, hertz, wide, seed):
    channel = ChannelUncertainty(
        gain=Interval(1.0, 1.0 - gain, 1.0 + gain),
        poles=(Interval(pole, pole - reach, pole + reach),),
        modes=(
            Mode(Interval(hertz, hertz * (1 - wide), hertz * (1 + wide)), Interval(0.2, 0.2 - wide / 2, 0.2 + wide)),
        ),
        most_delay=1,
    )
    for cell in first_cells(one(channel)):
        with np.errstate(all="ignore"):
            centres, radii, _ = disks(cell, ANGLES, DT)
        for sample in samples(one(channel), 10, seed):
            late = Sample(sample.values, cell.delays)
            phi = response(factor_system(one(channel), late, DT), ANGLES)[:, 0, 0]
            outside = np.abs(phi - centres[:, 0]) - radii[:, 0]
            assert np.all(~np.isfinite(radii[:, 0]) | (outside <= 1e-9 * (1.0 + np.abs(phi))))


def test_halving_a_cell_covers_it_again_with_smaller_disks():
    (cell,) = first_cells(one(GAIN_POLE))
    whole = disks(cell, ANGLES, DT)[1]
    for part in (0, 1):
        halves = [disks(half, ANGLES, DT)[1] for half in cell.halves(0, part)]
        assert np.all(halves[0] < whole)
        assert np.all(halves[1] < whole)
    low, high = cell.halves(0, 1)
    assert low.uncertainty.channels[0].poles[0].low == 0.93
    assert low.uncertainty.channels[0].poles[0].high == high.uncertainty.channels[0].poles[0].low
    assert high.uncertainty.channels[0].poles[0].high == 0.96


# --- what is proved --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("channel", [GAIN, GAIN_POLE, BOUND, MIXED], ids=["gain", "gain and pole", "bound", "mixed"])
def test_the_bound_is_close_above_the_worst_that_was_sampled(nominal, channel):
    found = analyse(nominal.problem, nominal.observer, one(channel))
    assert found.stable
    assert found.gamma_nominal < found.gamma_sampled <= found.gamma_bound < 1.1 * found.gamma_sampled
    assert found.gamma_nominal == pytest.approx(nominal.certificate.gamma, rel=1e-3)


@pytest.mark.parametrize("channel", [GAIN, GAIN_POLE, BOUND, MIXED], ids=["gain", "gain and pole", "bound", "mixed"])
def test_proved_safe_and_found_unstable_nearly_meet(nominal, channel):
    found = analyse(nominal.problem, nominal.observer, one(channel))
    assert found.safe_factor < found.unsafe_factor < 1.06 * found.safe_factor
    assert found.mu_bound == 1.0 / found.safe_factor


def test_no_random_plant_does_worse_than_the_bound_measured_by_another_algorithm(nominal):
    """Fresh plants, wired anew in state space, their norms by the symplectic pencil."""
    found = analyse(nominal.problem, nominal.observer, one(GAIN_POLE))
    for sample in samples(one(GAIN_POLE), 30, seed=99):
        assert hinf_norm(error_of(nominal.problem, nominal.observer, one(GAIN_POLE), sample))[0] <= found.gamma_bound


def test_every_plant_of_the_proved_set_is_stable(nominal):
    found = analyse(nominal.problem, nominal.observer, one(GAIN_POLE))
    widest = one(GAIN_POLE).scaled(found.safe_factor)
    for sample in samples(widest, 40, seed=5):
        plant = PLANT * factor_system(widest, sample, DT)
        assert spectral_radius(close_loop(plant, PID, nominal.observer, (1,)).system.A) < 1.0


def test_the_safe_gain_is_the_gain_margin(nominal):
    """One uncertain gain is the classical case: the eigenvalues along the interval say where stability ends."""
    found = analyse(nominal.problem, nominal.observer, one(GAIN))

    def stable(gain):
        return spectral_radius(close_loop(PLANT * gain, PID, nominal.observer, (1,)).system.A) < 1.0

    steps = np.arange(0.0, 3.3, 0.01)
    margin = next(k for k in steps if not (stable(1.0 + 0.3 * k) and stable(1.0 - 0.3 * k)))
    assert margin * (1 - 3 * FACTOR_STEP) < found.safe_factor <= margin <= found.unsafe_factor


def test_a_flexible_mode_may_move(nominal):
    flexed = flexible()
    found = analyse(flexed.problem, flexed.observer, one(RESONANT))
    assert found.stable
    assert found.gamma_sampled <= found.gamma_bound < 1.5 * found.gamma_sampled
    for sample in samples(one(RESONANT), 20, seed=3):
        assert hinf_norm(error_of(flexed.problem, flexed.observer, one(RESONANT), sample))[0] <= found.gamma_bound


def test_several_axes_are_uncertain_independently():
    result = synthesize(stack([PLANT, 0.6 * PLANT]), stack([PID, PID / 0.6]), stack([W_D] * 2), stack([W_N] * 2))
    single = synthesize(PLANT, PID, W_D, W_N)
    both = Uncertainty((GAIN, ChannelUncertainty(gain=Interval(1.0, 0.9, 1.1))))
    found = analyse(result.problem, result.observer, both)
    alone = analyse(single.problem, single.observer, one(GAIN))
    assert found.stable
    assert found.gamma_sampled <= found.gamma_bound < 1.2 * found.gamma_sampled
    # decoupled, of one gamma: the wider channel decides, up to the near-optimal observers' own differences
    assert found.safe_factor == pytest.approx(alone.safe_factor, rel=0.1)


def test_the_scaled_bound_for_several_inputs_holds_for_random_perturbations():
    result = synthesize(stack([PLANT, 0.6 * PLANT]), stack([PID, PID / 0.6]), stack([W_D] * 2), stack([W_N] * 2))
    coupled = replace(result.problem, controller=result.problem.controller * np.array([[1.0, 0.2], [-0.1, 1.0]]))
    grid = interconnect(coupled, result.observer, np.linspace(0.01, 3.1, 80))
    radii = np.full((80, 2), 0.2)
    beta, gamma = grid.bounds(np.ones((80, 2), dtype=complex), radii)
    assert np.max(beta) < 1.0
    rng = np.random.default_rng(1)
    for _ in range(200):
        delta = radii * np.exp(2j * np.pi * rng.uniform(size=(80, 2)))
        assert np.all(np.linalg.norm(grid.closed(1.0 + delta), 2, axis=(1, 2)) <= gamma * (1.0 + 1e-9))


def test_the_bound_for_several_inputs_agrees_with_mu_of_dkpy():
    """dkpy (MIT) as peer: its mu by LMI at each frequency, to the accuracy of its bisection."""
    dkpy = pytest.importorskip("dkpy")
    result = synthesize(stack([PLANT, 0.6 * PLANT]), stack([PID, PID / 0.6]), stack([W_D] * 2), stack([W_N] * 2))
    coupled = replace(result.problem, controller=result.problem.controller * np.array([[1.0, 0.2], [-0.1, 1.0]]))
    grid = interconnect(coupled, result.observer, np.geomspace(0.02, 3.0, 6))
    beta, _ = grid.bounds(np.ones((6, 2), dtype=complex), np.full((6, 2), 0.2))
    blocks = [dkpy.ComplexFullBlock(1, 1), dkpy.ComplexFullBlock(1, 1)]
    solver = dkpy.SsvLmiBisection(n_jobs=1)
    mu = solver.compute_ssv(np.moveaxis(0.2 * grid.M11, 0, 2), blocks)[0]
    np.testing.assert_allclose(beta, mu, rtol=5e-3)


def test_a_destabilizing_factor_has_the_phase_asked_for_and_never_more_than_its_size():
    for angle in (0.05, 0.6, 2.0, 3.0):
        for phase in np.linspace(-3.1, 3.1, 7):
            w = all_pass(angle, phase, DT) * band_pass(angle, 0.1, DT)
            assert response(w, np.array([angle]))[0, 0, 0] == pytest.approx(np.exp(1j * phase), abs=1e-7)
            assert hinf_norm(w)[0] <= 1.0 + 1e-6


def destabilizing(nominal, hertz, sizes):
    grid = interconnect(nominal.problem, nominal.observer, np.unique(np.append(ANGLES, 2.0 * np.pi * DT * hertz)))
    channel = ChannelUncertainty(frequency_hz=tuple(hertz), multiplicative=sizes)
    return grid, destabilized(grid, one(channel), zpk([], [], 1.0, DT))


def test_a_destabilizing_factor_keeps_within_a_bound_that_rises_in_a_step(nominal):
    hertz, sizes = np.array([0.0, 10.0, 10.01, 125.0]), (0.1, 0.1, 0.8, 0.8)
    grid, (factor,) = destabilizing(nominal, hertz, sizes)
    w = response(factor, grid.angles)[:, 0, 0] - 1.0
    bound = np.interp(grid.angles, 2.0 * np.pi * DT * hertz, sizes)
    assert np.all(np.abs(w) <= bound * (1.0 + 1e-6))
    assert np.max(np.abs(w) / bound) == pytest.approx(1.0, abs=1e-6)


def test_a_bound_that_no_factor_keeps_within_is_an_error_and_not_a_plant_outside_of_it(nominal):
    """A needle at 10 Hz: whatever has that gain there has more than the bound beside it."""
    needle = np.array([0.0, 10.0 - 1e-7, 10.0, 10.0 + 1e-7, 125.0])
    with pytest.raises(
        NotConvergedError, match=r"no factor of gain 0\.8 at 10 Hz keeps within the multiplicative bound"
    ):
        destabilizing(nominal, needle, (0.001, 0.001, 0.8, 0.001, 0.001))


# --- the synthesis ---------------------------------------------------------------------------------------------------


def test_a_nominal_design_on_an_uncertain_plant_says_how_far_it_is_safe():
    text = SPEC.read_text(encoding="utf-8").replace('synthesis = "robust"', 'synthesis = "nominal"')
    extra = design_from_toml(text).blocks[0].certificate.extra
    assert extra["robust_noise_scale"] == 1.0
    assert extra["robust_stable"] is False
    assert 0.9 < extra["robust_safe_factor"] < 1.0 <= extra["robust_unsafe_factor"] < 1.01
    assert "robust_gamma_bound" not in extra


def test_a_robust_design_is_proved_over_all_that_was_stated(robust):
    extra = robust.blocks[0].certificate.extra
    assert extra["robust_stable"] is True
    assert extra["robust_safe_factor"] > 1.3
    assert extra["robust_gamma_nominal"] < extra["robust_gamma_sampled"] <= extra["robust_gamma_bound"]
    assert extra["robust_grid_guard"] >= GUARD


def attenuation_of(design):
    """RMS attitude error off / on in the paper's weather, by the Lyapunov equations of the loop."""
    vehicle, rms = vehicle_of("pitch"), weather_of("pitch").rms
    observer = from_data(design.blocks[0].observer, DT)
    off, on = (expect(close(vehicle, each), rms).attitude for each in (no_observer(DT), observer))
    return off / on


def test_by_what_a_pilot_wants_the_same_safety_costs_far_less_attenuation_than_by_weights(robust, scaled):
    """In both the proof ends where the loop without observer becomes unstable."""
    safe, before = (each.blocks[0].certificate.extra["robust_safe_factor"] for each in (robust, scaled))
    assert safe >= before * (1.0 - FACTOR_STEP)
    assert safe > 1.98
    assert attenuation_of(robust) > 1.5 * 5.5
    assert attenuation_of(scaled) < 4.0


def test_a_robust_observer_is_optimal_for_its_own_weights_and_keeps_what_auto_asks(robust):
    proof = robust.blocks[0].certificate
    assert proof.gamma <= 1.0003 * proof.gamma_star
    assert proof.disk_margin >= 0.4
    assert proof.delay_margin_samples >= 1
    assert proof.slowest_mode_s <= 0.5
    assert proof.extra["order"] <= 6


def test_what_the_loop_does_not_bear_at_one_frequency_takes_nothing_from_the_others():
    """Of a bound of 0.95 below 1 Hz, where the loop answers in full, it bears 1.05 times as much."""
    axis = Axis.of(PLANT, PID, 1, 0.0)
    on = Search(axis, Spectrum(LowPass(1.0)), 6).on
    stated = ChannelUncertainty(frequency_hz=(0.0, 1.0, 2.0, 60.0), multiplicative=(0.95, 0.95, 0.1, 0.9))
    kept = factors(on, one(stated), 1.02, 0).bound
    hertz = on.angles / (2.0 * np.pi * DT)
    times = kept / np.interp(hertz, stated.frequency_hz, stated.multiplicative)
    assert np.all((times > 1.019) & (times < 2.001))
    assert np.max(times[hertz < 1.0]) < 1.05
    assert np.all(times[hertz > 2.0] == pytest.approx(2.0))
    assert np.max(kept * np.abs(1.0 - on.S)) < 1.0


def test_an_uncertainty_that_leaves_no_room_for_the_limits_is_refused_in_words():
    text = SPEC.read_text(encoding="utf-8").replace("least_disk_margin = 0.4", "least_disk_margin = 1.4")
    with pytest.raises(UnsolvableError, match=r"keeps the limits of \[auto\] and bears 1\.9\d times the stated"):
        design_from_toml(text)


def test_a_robust_design_does_not_lose_where_the_nominal_one_is_robust_already(nominal):
    before = analyse(nominal.problem, nominal.observer, one(BOUND))
    after = synthesize(PLANT, PID, W_D, W_N, delay_samples=1, uncertainty=one(BOUND))
    assert after.certificate.extra["robust_gamma_bound"] < 0.7 * before.gamma_bound
    assert after.certificate.gamma <= 1.01 * after.certificate.gamma_star


def test_inspect_measures_the_robust_findings_again(robust):
    findings = verify(loads(dumps(robust)[0]))
    names = {finding.name for finding in findings if finding.name.startswith("robust_")}
    assert {"robust_safe_factor", "robust_gamma_bound", "robust_gamma_sampled"} <= names
    assert all(finding.agrees for finding in findings)


def test_inspect_does_not_believe_a_bound_that_was_made_smaller(robust):
    block = robust.blocks[0]
    extra = {**block.certificate.extra, "robust_gamma_bound": 0.9 * block.certificate.extra["robust_gamma_bound"]}
    forged = replace(robust, blocks=(replace(block, certificate=replace(block.certificate, extra=extra)),))
    assert [finding.name for finding in verify(forged) if not finding.agrees] == ["robust_gamma_bound"]


def test_inspect_misses_a_finding_that_was_taken_out(robust):
    block = robust.blocks[0]
    extra = {name: value for name, value in block.certificate.extra.items() if name != "robust_unsafe_factor"}
    cut = replace(robust, blocks=(replace(block, certificate=replace(block.certificate, extra=extra)),))
    assert [finding.name for finding in verify(cut) if not finding.agrees] == ["robust_unsafe_factor"]


def test_the_problem_stays_the_one_asked_for_apart_from_its_noise_weight(scaled):
    stored = scaled.blocks[0]
    scale = stored.certificate.extra["robust_noise_scale"]
    assert scale > 1.0
    asked = Problem(PLANT, PID, W_D, W_N, (1,))
    shown = response(asked.noise_weight, ANGLES)[:, 0, 0]
    weight = stored.problem.noise_weight
    z = np.exp(1j * ANGLES)
    solved = np.array([(weight.C @ np.linalg.solve(x * np.eye(1) - weight.A, weight.B) + weight.D)[0, 0] for x in z])
    np.testing.assert_allclose(solved, scale * shown, rtol=1e-9)


# --- told to people --------------------------------------------------------------------------------------------------


def test_the_command_line_says_how_far_it_is_safe(robust):
    said = robustness_words(robust.blocks[0])
    extra = robust.blocks[0].certificate.extra
    assert "robust stability         proved" in said
    assert f"safe up to               {extra['robust_safe_factor']:.4g} times" in said
    assert f"at most {extra['robust_gamma_bound']:.4g}" in said


def test_a_design_without_uncertainty_says_nothing_of_it(nominal, robust):
    plain = replace(robust.blocks[0], certificate=nominal.certificate)
    assert robustness_words(plain) == ""
    assert robust_bands(plain, DT) is None
    assert robust_claims(plain) == ()


def test_the_report_draws_the_bands_and_states_the_claim(robust):
    page = design_page(robust)
    assert "Uncertain plants" in page
    assert "Robust over the stated uncertainty." in page


def test_every_drawn_plant_stays_below_what_is_guaranteed(robust):
    bands = robust_bands(robust.blocks[0], DT)
    assert bands.stable == bands.tried
    assert np.all(bands.error.high <= bands.allowed)
    for spread in (bands.rate_off, bands.rate_on, bands.error):
        assert np.all((spread.low <= spread.model) & (spread.model <= spread.high))
