"""Random plants and limits: a certified design within them, or a refusal that says which of them stands in the way.

Every limit is measured here from the matrices that go into design.json, on a grid of this file's own.
"""

import re

import control as ct
import numpy as np
import pytest

from dob_companion.comparison.vehicle import Vehicle, close, no_observer
from dob_companion.errors import UnsolvableError
from dob_companion.lti.response import response, spectral_radius
from dob_companion.synthesis import parse_spec
from dob_companion.synthesis.plant.models import from_data
from dob_companion.synthesis.tune import best
from dob_companion.synthesis.tune.tuning import Task, designed_and_tuned

DT = 0.004
ANGLES = np.unique(np.concatenate([np.geomspace(1e-5, np.pi, 8000), np.linspace(1e-4, np.pi, 8000)]))


def random_text(seed):
    """A rigid craft with a lag, a slow pole or a flexible mode, held well by a PI controller; and any limits."""
    rng = np.random.default_rng(seed)
    while True:
        gain, lag = 10.0 ** rng.uniform(0.5, 2.5), rng.uniform(0.01, 0.1)
        slow = rng.choice([0.0, rng.uniform(0.1, 2.0)])
        num, den = np.array([gain]), np.polymul([lag, 1.0], [1.0, slow])
        if rng.random() < 0.3:
            low, ratio, damping = rng.uniform(40.0, 120.0), rng.uniform(1.1, 1.6), rng.uniform(0.02, 0.1)
            num = np.polymul(num, [ratio**2, 2.0 * damping * low * ratio**2, (low * ratio) ** 2])
            den = np.polymul(den, [1.0, 2.0 * damping * low * ratio, (low * ratio) ** 2])
        if rng.random() < 0.3:
            num = np.polymul(num, [-1.0 / rng.uniform(40.0, 200.0), 1.0])
        crossing = rng.uniform(3.0, 12.0)
        P = crossing / gain
        controller = [P, P * rng.uniform(0.2, 1.5)], [1.0, 0.0]
        attitude = rng.uniform(0.15, 0.4) * crossing
        vehicle = Vehicle(
            ct.c2d(ct.ss(ct.tf(num, den)), DT),
            ct.ss(ct.c2d(ct.tf(*controller), DT, "tustin")),
            int(rng.integers(0, 4)),
            attitude,
        )
        if spectral_radius(close(vehicle, no_observer(DT)).A) < 0.9999:
            break
    auto = {
        "disturbance_corner_hz": 10.0 ** rng.uniform(-0.5, 0.5),
        "noise_rms": 10.0 ** rng.uniform(-4.0, -2.5),
        "least_disk_margin": rng.uniform(0.2, 1.0),
        "largest_noise_in_correction": 10.0 ** rng.uniform(-4.0, -2.0),
        "attitude_gain": attitude,
        "least_delay_margin_samples": int(rng.integers(0, 4)),
        "largest_slowest_mode_s": rng.uniform(0.1, 1.0),
    }
    if rng.random() < 0.5:
        auto["disturbance_rms"] = rng.uniform(0.01, 0.1)
    if rng.random() < 0.3:
        auto["gains"] = []
    if rng.random() < 0.3:
        auto["largest_noise_gain"] = 10.0 ** rng.uniform(-1.0, 1.0)
    if rng.random() < 0.5:
        auto["moment_rate_hz"] = rng.uniform(100.0, 300.0)
    lines = [f"[design]\nrate_hz = 250.0\ndelay_samples = {vehicle.delay}\n[auto]"]
    lines += [f"{key} = {value}" for key, value in auto.items()]
    lines += ['[[block]]\nname = "any"\naxes = ["roll"]']
    lines += [f'[block.plant]\ndomain = "s"\nnum = {num.tolist()}\nden = {den.tolist()}']
    lines += [f'[block.controller]\ndomain = "s"\nmethod = "tustin"\nnum = {controller[0]}\nden = {controller[1]}']
    return "\n".join(lines), vehicle


def kept(block, vehicle, asked):
    """Every limit, from the matrices."""
    D = from_data(block.observer, DT)
    G, C, D_y, D_u = (
        response(vehicle.plant, ANGLES)[:, 0, 0],
        response(vehicle.controller, ANGLES)[:, 0, 0],
        *response(D, ANGLES)[:, 0].T,
    )
    late = np.exp(-1j * vehicle.delay * ANGLES)
    leak = np.max(np.abs((D_y * G + D_u) * C / (1.0 + C * G)))  # from a rate that is asked for to d_hat
    sensitivity = (1.0 + late * D_u) / (1.0 + late * D_u + (C + late * D_y) * G)
    missed = -late * D_u / (1.0 + late * D_u + (C + late * D_y) * G)  # from what u_e is misread by to u_e
    power = np.sum(np.gradient(ANGLES) / np.pi * np.abs(D_y) ** 2)  # n -> d_hat: what u_e adds is the leak
    radii = [
        spectral_radius(close(vehicle, D, attitude=False, unseen=k).A[:-1, :-1])
        for k in range(asked.least_delay_margin + 1)
    ]
    radius = spectral_radius(D.A)
    assert leak < 2e-6
    assert 1.0 / np.max(np.abs(sensitivity - 0.5)) >= asked.least_disk_margin * (1.0 - 1e-4)
    assert asked.noise_rms * np.sqrt(power) <= asked.largest_noise * 1.001
    assert asked.largest_peak is None or np.max(np.abs(D_y)) <= asked.largest_peak * 1.001
    if asked.moment_rate_hz is not None:
        on_a_line = np.sinc(ANGLES / (2.0 * np.pi * DT * asked.moment_rate_hz)) ** 2
        assert np.max(np.abs(missed) * (1.0 - on_a_line)) <= 0.1 * 1.05
    assert max(radii) < 1.0
    assert radius == 0.0 or -DT / np.log(radius) <= asked.largest_mode_s * 1.001


def is_kept_or_refused(seed):
    """Whether there was a design."""
    text, vehicle = random_text(seed)
    spec = parse_spec(text)
    (asked,) = spec.blocks
    refused = ""
    try:
        block, _ = designed_and_tuned(Task(asked, spec.dt, asked.auto))
    except UnsolvableError as reason:
        refused = str(reason)
    if refused:
        assert re.search(r"in the way: (disk margin|delay margin|noise|slowest|the moment|more than one)", refused), (
            refused
        )
        return False
    kept(block, vehicle, asked.auto)
    found = block.certificate.extra
    assert 1.0 < found["attenuation"] <= found["attenuation_limit"] * (1.0 + 1e-4)
    assert block.certificate.gamma <= 1.0003 * block.certificate.gamma_star
    return True


@pytest.fixture
def alone(monkeypatch):
    """What is asked and no trade-off around it, which takes most of the time and none of what is shown here."""
    monkeypatch.setattr(best._Choice, "others", lambda _: [])
    monkeypatch.setattr(best._Choice, "quieter", lambda *_: [])


@pytest.mark.parametrize(("seed", "designed"), [(2, True), (4, True)])
def test_a_random_plant_and_limits_give_a_design_that_keeps_them_or_a_refusal_that_says_why(seed, designed, alone):
    assert is_kept_or_refused(seed) == designed


@pytest.mark.proof
def test_many_random_plants_and_limits_do_and_most_of_them_are_designed(alone):
    assert sum(is_kept_or_refused(seed) for seed in range(10, 50)) >= 15
