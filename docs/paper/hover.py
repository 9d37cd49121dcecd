"""Figures 11 to 14: three axes in hover under a 1 Hz disturbance, observer off and on, over the real link."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import butter, sosfiltfilt

from dob_companion.artifact import AXES, DobDesign, loads
from dob_companion.comparison.flight import FLIGHT_S, attitude, make_weather
from dob_companion.comparison.vehicle import Vehicle, close
from dob_companion.report.chart import Array, Chart, Curve, Panel, Scale, symmetric
from dob_companion.report.flight_charts import figure_11, figure_12, figure_13
from dob_companion.report.trace import FlightTrace
from dob_companion.synthesis.plant.models import from_data
from docs.paper.section import Number, Section

PAPER_OFF, PAPER_ON = (0.15, 0.12, 0.12), (0.02, 0.01, 0.02)
"""Largest attitude errors, rad, roll, pitch, yaw (Section IV). They are printed to one digit: 0.01 is 0.005…0.015."""

HALF_DIGIT = 0.005
RATE_HZ, DISTURBANCE_HZ = 250.0, 1.0
MOST_LAG = 50
SIGMA = 10.0 ** (-68.0 / 20.0)
"""Standard deviation of noise of −68 dBW, rad/s."""


SEEDS = 20
"""As many linear flights as `dob-companion compare` makes."""


def sections(work: Path, without_link: DobDesign) -> list[Section]:
    """The sections of the flights in `work`, named by vehicle and weights; `without_link` is for a delay of 0."""
    trace, result = _read(work / "nonlinear")
    with_link = loads((work / "nonlinear" / "design.json").read_text("utf-8"))
    return [
        _off(trace, result),
        _on(trace, result, pitch_peak(without_link), pitch_peak(with_link)),
        _on_tuned(*_read(work / "nonlinear_tuned")),
        _on_linear(_read(work / "linear")[1], _read(work / "linear_tuned")[1]),
        _estimate(trace),
        _noise(trace),
    ]


def _read(flight: Path) -> tuple[FlightTrace, dict[str, Any]]:
    trace = FlightTrace.from_bytes((flight / "flight.npz").read_bytes(), "flight.npz")
    return trace, json.loads((flight / "result.json").read_text("utf-8"))


def _off(trace: FlightTrace, result: dict[str, Any]) -> Section:
    peaks = [result["axes"][axis]["peak_off"] for axis in AXES]
    return Section(
        "Figure 11",
        "attitude, observer off",
        "Largest errors of 0.15, 0.12 and 0.12 rad in roll, pitch and yaw.",
        f"Scenario `{result['scenario']}`, seed {result['seed']}, {result['clock']}: the nonlinear tail-sitter and the "
        "companion are two processes on a MAVLink link. The paper does not print the disturbance's strength; it is "
        "scaled until these peaks come out, so this figure agrees by construction.",
        tuple(
            Number(f"{axis}, largest error", f"{paper:g} rad", ours, "rad", paper - HALF_DIGIT, paper + HALF_DIGIT)
            for axis, paper, ours in zip(AXES, PAPER_OFF, peaks, strict=True)
        ),
        (figure_11(trace),),
    )


def pitch_peak(design: DobDesign) -> float:
    """Largest attitude error of the linear pitch axis, rad: the mean of SEEDS flights at the design's own delay."""
    (block,) = (block for block in design.blocks if block.axes == ("pitch",))
    plant, controller = (from_data(data, design.dt) for data in (block.problem.plant, block.problem.controller))
    vehicle = Vehicle(plant, controller, block.delay_samples)
    weather = make_weather(vehicle, PAPER_OFF[AXES.index("pitch")], SEEDS)
    theta = attitude(close(vehicle, from_data(block.observer, design.dt)), weather.d, weather.n)
    return float(np.mean(np.max(np.abs(theta), axis=0)))


def _on(trace: FlightTrace, result: dict[str, Any], without_link: float, with_link: float) -> Section:
    return Section(
        "Figure 12",
        "attitude, observer on, the paper's weights",
        "Largest errors of 0.02, 0.01 and 0.02 rad: 7.5×, 12× and 6× less. The paper's observer runs inside the "
        "controller, without a link.",
        f"The second window of the same flight; the measured delay is {result['delay_samples']} sample, "
        f"{result['samples_lost']} of {result['samples']} samples lost. Accepted is what rounds to the paper's digit, "
        "or better.",
        _improvements(result),
        (figure_12(trace),),
        (
            "The link costs: on the linear pitch axis the same weights, solved for the delay, reach a peak of "
            f"{without_link:.4f} rad without a link and {with_link:.4f} with its one sample (mean of {SEEDS} linear "
            f"flights of {FLIGHT_S:g} s; [optimum](optimum.md) has the RMS at every delay).",
            "The rotors cost as well: the largest gusts of this disturbance take all the torque there is, and a peak "
            "is one such moment. RMS hardly feels it; compare the linear axes below.",
        ),
    )


def _on_tuned(trace: FlightTrace, result: dict[str, Any]) -> Section:
    chart = replace(figure_12(trace), key="fig12_tuned")
    return Section(
        "Figure 12, tuned",
        "attitude, observer on, tuned weights",
        "As above.",
        "`examples/tailsitter_tuned.toml`: the same plant, controller and link; the best "
        "observers in this weather at their disk margin and noise, and the weights of these ([how](tuning.md)).",
        _improvements(result),
        (chart,),
    )


def _on_linear(plain: dict[str, Any], tuned: dict[str, Any]) -> Section:
    rows = [
        replace(number, what=f"{number.what}, {weights} weights")
        for weights, result in (("the paper's", plain), ("tuned", tuned))
        for number in _improvements(result)
    ]
    return Section(
        "Figure 12, once more",
        "on the identified linear axes",
        "As above; the paper's own design model is linear.",
        "Scenario `paper`: the same two flights of the three linear models that the sweep identified, which have no "
        "rotors to run out of.",
        tuple(rows),
    )


def _improvements(result: dict[str, Any]) -> tuple[Number, ...]:
    rows: list[Number] = []
    for axis, off, on in zip(AXES, PAPER_OFF, PAPER_ON, strict=True):
        ours, least = result["axes"][axis], off / (on + HALF_DIGIT)
        rows += [
            Number(f"{axis}, largest error", f"{on:g} rad", ours["peak_on"], "rad", high=on + HALF_DIGIT),
            Number(f"{axis}, peak off / on", f"{off / on:g}×", ours["peak_ratio"], "×", low=least),
            Number(f"{axis}, RMS off / on", "not said", ours["rms_ratio"], "×", low=least),
        ]
    return tuple(rows)


def _estimate(trace: FlightTrace) -> Section:
    rows = trace.rows("on")
    d, d_hat = trace.disturbance[rows], -trace.correction[rows]
    numbers = []
    for i, axis in enumerate(AXES):
        slow, seen = lowpassed(d[:, i], DISTURBANCE_HZ), lowpassed(d_hat[:, i], DISTURBANCE_HZ)
        numbers += [
            Number(f"{axis}, fit below 1 Hz, the disturbance's band", "“quite well”", fit(slow, seen), "%", low=80.0),
            Number(f"{axis}, correlation", "not said", _correlation(d[:, i], d_hat[:, i]), "", low=0.8),
            Number(f"{axis}, lag of best correlation", "not said", lag_ms(d[:, i], d_hat[:, i]), "ms", high=40.0),
        ]
    return Section(
        "Figure 13",
        "the disturbance and its estimate",
        "“The estimated disturbance tracks the actual disturbance quite well.”",
        "d is what the simulator adds; d̂ is what the vehicle received and applied, one sample late. The fit is "
        "1 − ‖d − d̂‖ / ‖d − mean‖, as in system identification.",
        tuple(numbers),
        (figure_13(trace),),
        (
            "A first-order low-pass leaves a tenth of the disturbance's power above 6 Hz, and the estimate lags; both "
            "keep the correlation from 1.",
        ),
    )


def fit(true: Array, estimated: Array) -> float:
    """100 (1 − ‖true − estimated‖ / ‖true − mean‖), per cent."""
    return float(100.0 * (1.0 - np.linalg.norm(true - estimated) / np.linalg.norm(true - true.mean())))


def lowpassed(x: Array, hertz: float) -> Array:
    """A trace sampled at 250 Hz without what lies above `hertz`: second-order Butterworth, forwards and backwards."""
    y: Array = sosfiltfilt(butter(2, hertz, fs=RATE_HZ, output="sos"), x)
    return y


def lag_ms(true: Array, estimated: Array) -> float:
    """How long after `true` the estimate looks most like it, ms, to the sample."""
    at = [_correlation(true[: len(true) - k], estimated[k:]) for k in range(1, MOST_LAG)]
    return 1e3 * (1 + int(np.argmax(at))) / RATE_HZ


def _correlation(a: Array, b: Array) -> float:
    return float(np.corrcoef(a, b)[0, 1])


def _noise(trace: FlightTrace) -> Section:
    rows = trace.rows("off")
    time, noise = trace.seconds(rows), trace.gyro[rows] - trace.rate[rows]
    power = 10.0 * np.log10(np.mean(noise**2, axis=0))
    limit = symmetric([noise])
    panels = tuple(
        Panel(i, 0, Scale("time in the window", "s", 0.0, float(np.ceil(time[-1]))),
              Scale("gyro noise", "rad/s", -limit, limit), (Curve("n", time, noise[:, i], "bound", width=0.6),),
              title=axis)
        for i, axis in enumerate(AXES)
    )  # fmt: skip
    chart = Chart("fig14", "Gyro noise on three axes.", panels, 1120, 420, row_heights=(1.0, 1.0, 1.0))
    lag = [_correlation(noise[1:, i], noise[:-1, i]) for i in range(3)]
    return Section(
        "Figure 14",
        "measurement noise",
        "“White Gaussian noise with the power of −68 dBW.”",
        f"Gyro reading minus the true rate in the same flight; −68 dBW is a standard deviation of {SIGMA:.3g} rad/s.",
        tuple(
            Number(f"{axis}, power", "−68 dBW", float(p), "dBW", -68.3, -67.7)
            for axis, p in zip(AXES, power, strict=True)
        )
        + tuple(
            Number(f"{axis}, correlation with the sample before", "white: 0", each, "", -0.05, 0.05)
            for axis, each in zip(AXES, lag, strict=True)
        ),
        (chart,),
    )
