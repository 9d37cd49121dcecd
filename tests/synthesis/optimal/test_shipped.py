"""The shipped tuned specs: near what any observer reaches, not below those that they replaced, made again by --auto."""

import pytest

from dob_companion.comparison.flight import expect
from dob_companion.comparison.vehicle import close
from dob_companion.synthesis import design_from_toml, parse_spec
from dob_companion.synthesis.plant.models import from_data
from dob_companion.synthesis.tune.tuning import Task, designed_and_tuned
from docs.shipped import BEFORE, attenuations
from docs.tuned import Case
from tests.synthesis.optimal.axes import EXAMPLES, TUNED, block_of, vehicle_of

SHARE = {(axis, delay): 0.92 if axis == "roll" else 0.94 for axis in ("pitch", "roll", "yaw") for delay in TUNED}
SHARE["pitch", 0] = 0.93  # two samples of delay margin, which the bound leaves out, cost most without a link
"""Of the bound for any observer, at least, the plant as modelled."""

SLACK = {("pitch", 0): 0.985}
"""Of the searched weights' attenuation that is reached everywhere, where it is less than 0.99."""

PEAKS = {"pitch": 12.0, "roll": 7.5, "yaw": 6.0}
"""Peak off / on that the paper reports."""

every_delay = pytest.mark.parametrize("delay", [1, *(pytest.param(d, marks=pytest.mark.proof) for d in (0, 2, 3))])


@pytest.fixture(scope="module")
def shipped():
    """By delay, solved once."""
    found = {}

    def of(delay):
        if delay not in found:
            found[delay] = design_from_toml((EXAMPLES / TUNED[delay]).read_text("utf-8"), TUNED[delay])
        return found[delay]

    return of


@every_delay
def test_they_reach_nearly_what_any_observer_can_and_keep_their_limits(shipped, delay):
    for block in shipped(delay).blocks:
        least = SHARE[block.name, delay]
        proof, asked = block.certificate, block_of(block.name, delay).auto
        share = proof.extra["attenuation"] / proof.extra["attenuation_limit"]
        assert least <= share <= 1.0, (block.name, share)
        assert proof.disk_margin >= asked.least_disk_margin
        assert proof.delay_margin_samples >= asked.least_delay_margin
        vehicle = vehicle_of(block.name, delay)
        heard = expect(close(vehicle, from_data(block.observer, 0.004)), 1.0).noise_in_correction
        assert heard <= asked.largest_noise


@every_delay
def test_nowhere_are_they_below_the_weights_that_they_replaced(shipped, delay):
    design = shipped(delay)
    for block in design.blocks:
        now = attenuations(block, design.dt, block_of(block.name, delay).auto.disturbance_rms)
        slack = SLACK.get((block.name, delay), 0.99)
        for found, before in zip(now, BEFORE[block.name, delay], strict=True):
            assert found >= slack * before, (block.name, now)


@pytest.mark.proof
def test_with_a_sample_of_link_they_reach_the_papers_peaks_on_every_linear_axis(shipped):
    for axis, least in PEAKS.items():
        assert Case.of(shipped(1), axis).peak_ratio() >= least, axis


@pytest.mark.proof
@pytest.mark.parametrize("delay", TUNED)
def test_their_weights_are_those_that_auto_finds_for_what_they_ask(delay):
    spec = parse_spec((EXAMPLES / TUNED[delay]).read_text("utf-8"))
    for block in spec.blocks:
        _, tuning = designed_and_tuned(Task(block, spec.dt, block.auto))
        stated = block.disturbance.common.form
        assert tuning.disturbance.poles == pytest.approx(stated.poles, abs=1e-6)
        assert tuning.disturbance.gain == pytest.approx(stated.gain, rel=1e-6)
