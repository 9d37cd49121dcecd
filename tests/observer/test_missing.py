"""What is put in the place of missing samples, against a dense covariance and against flights drawn at random."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from dob_companion.artifact import StateSpaceData
from dob_companion.lti.loop import weighted_loop
from dob_companion.lti.predictor import Predictor
from dob_companion.observer import GyroModel, Missing, ObserverBank, missing_samples
from dob_companion.observer.missing import GROWTH, WEATHER, Weather, _Flight, longest, missing_in, stated_weather
from tests.companion.aircraft import small_design
from tests.observer.designs import designed

DESIGNS = ["paper", "tuned", "ardupilot"]


def flight_of(block, samples):
    weights = block.problem.disturbance_weight, block.problem.noise_weight
    return _Flight(block.problem, block.observer, block.delay_samples, samples, *weights)


def drawn(block, samples, seed, settle=2000):
    """y_n, u_e and d - z^-tau d_hat of a flight of the design's own loop, in its steady state."""
    problem = block.problem
    loop = weighted_loop(
        problem.plant,
        problem.controller,
        block.observer,
        problem.disturbance_weight,
        problem.noise_weight,
        block.delay_samples,
    )
    rng = np.random.default_rng(seed)
    x, rows = np.zeros(len(loop.A)), []
    for w in rng.normal(size=(settle + samples, loop.B.shape[1])):
        rows.append([float((C @ x + D @ w)[0]) for C, D in (loop.y_n, loop.u_e, loop.error)])
        x = loop.A @ x + loop.B @ w
    return np.array(rows[settle:]).T


@cache
def flight(name, axis, samples=60_000):
    block = next(block for block in designed(name).blocks if axis in block.axes)
    return block, drawn(block, samples, seed=len(name) + ord(axis[0]))


@pytest.mark.parametrize("steps", [1, 2, 5, 12])
@pytest.mark.parametrize("name", DESIGNS)
def test_the_surprise_is_shared_out_as_a_dense_covariance_says(name, steps):
    predictor = Predictor.of(designed(name).blocks[0].problem)
    n, w = predictor.B_w.shape
    root = np.linalg.cholesky(predictor.P + 1e-14 * np.trace(predictor.P) * np.eye(n))
    rows, state = [], np.hstack([root, np.zeros((n, steps * w))])
    for k in range(steps):
        white = np.zeros((w, n + steps * w))
        white[:, n + k * w : n + (k + 1) * w] = np.eye(w)
        rows.append(predictor.C @ state + predictor.D_w @ white)
        state = predictor.A @ state + predictor.B_w @ white
    y = np.vstack(rows)
    covariance = y @ y.T
    expected = covariance[:, -1] / covariance[-1, -1]
    assert np.ravel(predictor.bridging(steps)[steps]) == pytest.approx(expected, rel=1e-4, abs=1e-6)


@pytest.mark.proof
@pytest.mark.parametrize(("name", "axis"), [("paper", "pitch"), ("tuned", "roll"), ("ardupilot", "yaw")])
def test_the_errors_foreseen_are_those_of_flights_drawn_at_random(name, axis):
    block, (y, u, error) = flight(name, axis)
    predictor = Predictor.of(block.problem)
    foreseen = flight_of(block, 8)
    assert np.sqrt(np.mean(error**2)) == pytest.approx(foreseen.error_rms[0], rel=0.05)
    for missing in (1, 3, 6):
        pairs = [added(block, predictor, y, u, begin, missing) for begin in range(200, len(y) - 40, 40)]
        assert largest_rms(pairs) == pytest.approx(foreseen.without_pairs(missing)[0], rel=0.1)


def added(block, p, y, u, begin, missing):
    """What d_hat is off by in the 20 samples after the pairs begin + 1 … begin + missing have not come."""
    observer = block.observer
    held = u[begin]
    rates = y[begin : begin + missing + 1].copy()
    x = np.zeros(len(p.A))
    for k in range(begin - 150, begin):
        x = p.A @ x + p.B[:, 0] * u[k] + p.K[:, 0] * (y[k] - p.C[0] @ x - p.D[0, 0] * u[k])
    x = p.A @ x + p.B[:, 0] * held + p.K[:, 0] * (y[begin] - p.C[0] @ x - p.D[0, 0] * held)
    foreseen = []
    for _ in range(missing + 1):
        foreseen.append(p.C[0] @ x + p.D[0, 0] * held)
        x = p.A @ x + p.B[:, 0] * held
    surprise = y[begin + missing + 1] - foreseen[-1]
    weights = np.ravel(p.bridging(missing + 1)[-1])
    rates[1:] = np.array(foreseen[:-1]) + weights[:-1] * surprise
    off = np.zeros(observer.order)
    for k in range(missing + 1):
        off = observer.A @ off + observer.B @ [rates[k] - y[begin + k], held - u[begin + k]]
    after = []
    for _ in range(20):
        after.append(float(observer.C[0] @ off))
        off = observer.A @ off
    return after


def largest_rms(rows):
    return float(np.max(np.sqrt(np.mean(np.square(rows), axis=0))))


@pytest.mark.parametrize(("name", "bound"), [("paper", (1, 1)), ("tuned", (7, 12)), ("ardupilot", (6, 7))])
def test_the_bounds_are_the_longest_runs_that_at_most_double_the_error(name, bound):
    design = designed(name)
    assert missing_samples(design) == Missing(*bound)
    blocks = [flight_of(block, longest(design.dt) + 2) for block in design.blocks]

    def doubled(missing, of):
        return any(np.any(getattr(b, of)(missing) > np.sqrt(GROWTH**2 - 1) * b.error_rms) for b in blocks)

    for longest_run, of in zip(bound, ("without_pairs", "without_moments"), strict=True):
        assert longest_run == 1 or not any(doubled(missing, of) for missing in range(1, longest_run + 1))
        assert doubled(longest_run + 1, of)


@pytest.mark.parametrize("name", DESIGNS)
def test_what_comes_late_leaves_no_trace(name):
    off = (0.1, -0.2, 0.3)
    design, rng = designed(name), np.random.default_rng(5)
    known, late = ObserverBank(design, revisable=6), ObserverBank(design, revisable=6)
    model, late_model = (GyroModel(design, longest=10, revisable=6) for _ in range(2))
    truth = []
    for k in range(60):
        rates, moment = tuple(rng.normal(size=3)), tuple(rng.normal(size=3))
        truth.append(moment)
        known.advance(rates, moment)
        model.advance(rates, moment)
        held, used = truth[k - k % 5], tuple(np.subtract(rates, off if k % 5 else 0.0))
        late.advance(used, held)
        late_model.advance(used, held)
        if k % 5 == 4:
            for ago in range(4):
                change = tuple(np.subtract(truth[k - ago], held))
                late.revise(ago, off, change)
                late_model.revise(ago, off, change)
    y = (0.1, 0.2, 0.3)
    assert late.estimate(y) == pytest.approx(known.estimate(y), rel=1e-9, abs=1e-12)
    bridged = (m.bridge(y, [(0.1, 0.0, 0.0)] * 4, (0.0, 0.1, 0.0)) for m in (model, late_model))
    assert np.allclose(*bridged, rtol=1e-9, atol=1e-12)


def test_an_axis_that_no_block_covers_is_bridged_by_a_line():
    model = GyroModel(small_design(axes=("pitch",)), longest=10)
    rates = model.bridge((0.0, 0.0, 1.0), [(0.0, 0.0, 0.0)] * 4, (0.4, 0.0, 2.0))
    assert [(roll, yaw) for roll, _, yaw in rates] == [
        pytest.approx((0.1, 1.25)),
        pytest.approx((0.2, 1.5)),
        pytest.approx((0.3, 1.75)),
        pytest.approx((0.4, 2.0)),
    ]


def in_other_units(system, sizes):
    """The same system, its states measured in units of these sizes."""
    return StateSpaceData(system.A * sizes / sizes[:, None], system.B / sizes[:, None], system.C * sizes, system.D)


def test_the_bounds_do_not_depend_on_the_units_of_states():
    """A gyro filter in companion form has states a million times apart."""
    block = designed("ardupilot").blocks[0]
    bound = missing_in(block.problem, block.observer, block.delay_samples, 0.004)
    sizes = np.geomspace(1e-4, 1e4, len(block.problem.plant.A))
    plant = in_other_units(block.problem.plant, sizes)
    turned = replace(block.problem, plant=plant)
    assert missing_in(turned, block.observer, block.delay_samples, 0.004) == bound


def test_a_stated_weather_stands_in_the_place_of_weights():
    block = designed("paper").blocks[0]
    calm = Weather(disturbance_rms=0.05, corner_hz=0.3, noise_rms=1e-5)
    by_weather = missing_in(block.problem, block.observer, block.delay_samples, 0.004, calm)
    by_weights = missing_in(block.problem, block.observer, block.delay_samples, 0.004)
    assert by_weather.moments > by_weights.moments
    stated = replace(block.certificate, extra={**block.certificate.extra, WEATHER: calm._asdict()})
    assert stated_weather(stated) == calm
    for wrong in (
        None,
        3,
        {"noise_rms": 1.0},
        {**calm._asdict(), "corner_hz": -1.0},
        {**calm._asdict(), "corner_hz": "1"},
    ):
        assert stated_weather(replace(stated, extra={WEATHER: wrong})) is None
