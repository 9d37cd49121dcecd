"""How good an observer is in a stated weather, from its matrices, beside the most that any observer could be.

Attitude error as in `problem.py`, for coupled axes too. With T_f = 1 + z^-τ D_u, K = C (1 + kI) + z^-τ D_y and
K_n = C + z^-τ D_y, a plant g G leaves

    θ = I g G (T_f + K g G)^-1 (T_f d - K_n n)
"""

from collections.abc import Mapping
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import DobBlock
from dob_companion.errors import UnsolvableError
from dob_companion.lti.gramian import gramian
from dob_companion.lti.response import largest, response, spectral_radius
from dob_companion.observer.readings import MISREAD, misread_in, misreading
from dob_companion.synthesis.numeric import numbers_judged
from dob_companion.synthesis.optimal.asked import spectrum_of
from dob_companion.synthesis.optimal.bound import attenuation_limit
from dob_companion.synthesis.optimal.problem import Block, Spectrum, Wanted, grid
from dob_companion.synthesis.plant.loop import close_loop
from dob_companion.synthesis.plant.models import stack
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.spec.auto import AutoSpec, parse_auto
from dob_companion.synthesis.spec.spectrum import Band, Dryden, LowPass, Measured, Shape
from dob_companion.toml import Table

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

WEATHER = "attenuation_for"
"""Name of the finding that says for what the others hold: the keys and values of an [auto] table."""

GAINS = (0.7, 1.3)
"""Gains of the plant, as shares of the model's, at which the attenuation is told."""

POINTS = 4000
"""Angles of `grid` over which the attitude error is summed."""

AGAIN = 1.05
"""Share of a limit to which an observer that was solved again for weights of its own may come."""


def attenuation_findings(problem: Problem, observer: Any, auto: AutoSpec, disk_margin: float) -> dict[str, object]:
    """What a certificate says of the attenuation (docs/interfaces.md); `disk_margin` is the observer's own.

    The limits of `attenuation_limit` are those of [auto], or what the observer itself takes where that is more. Nothing
    is raised over numbers: an observer that is certified is no worse for a weather that has no answer.
    """
    found: dict[str, object] = {WEATHER: weather_record(auto)}
    try:
        with numbers_judged():
            return found | _findings(problem, observer, auto, disk_margin)
    except UnsolvableError as reason:
        return found | {"attenuation_absent": str(reason)}


def _findings(problem: Problem, observer: Any, auto: AutoSpec, disk_margin: float) -> dict[str, object]:
    found: dict[str, object] = {}
    spectrum = spectrum_of(auto)
    nominal = attenuation(problem, observer, auto, spectrum)
    if nominal is None:
        return found | {"attenuation_absent": "the attitude loop is unstable, or has no finite error"}
    found["attenuation"] = nominal
    if auto.moment_rate_hz is not None:
        found["misreading"] = misreading(problem, observer, problem.delays, problem.dt, auto.moment_rate_hz)
    found["attenuation_at_gains"] = {f"{g:g}": attenuation(problem, observer, auto, spectrum, g) for g in GAINS}
    wanted = _taken(observer, len(problem.plant.C), auto, disk_margin)
    try:
        with numbers_judged():
            block = Block(problem.plant, problem.controller, problem.delays, auto.attitude_gain)
            limit = attenuation_limit(block, spectrum, wanted)
    except UnsolvableError as reason:
        return found | {"attenuation_limit_absent": str(reason)}
    if limit is None:
        return found | {"attenuation_limit_absent": "no bound was found"}
    at = {"disk_margin": wanted.disk_margin, "noise": wanted.noise}
    at |= {} if wanted.peak is None else {"noise_gain": wanted.peak}
    return found | {"attenuation_limit": limit, "attenuation_limit_at": at}


def reads_well(block: DobBlock, dt: float, auto: AutoSpec) -> bool:
    """Whether `misreading` is within MISREAD, as near as an observer solved again for its weights comes to it."""
    hz = auto.moment_rate_hz
    return hz is None or misread_in(block, dt, hz) <= MISREAD * AGAIN


def attenuation(problem: Problem, observer: Any, auto: AutoSpec, spectrum: Spectrum, gain: float = 1.0) -> float | None:
    """RMS attitude error off / on, of all axes together; None when a loop is unstable, with the observer or without."""
    plant = problem.plant * gain if gain != 1.0 else problem.plant
    step, count = problem.dt * auto.attitude_gain, problem.plant.D.shape[0]
    around = stack([ct.ss([[1.0]], [[1.0]], [[step]], [[1.0 + step / 2.0]], problem.dt)] * count)
    controller = problem.controller * around if step else problem.controller
    for each in (None, observer):
        if spectral_radius(close_loop(plant, controller, each, problem.delays).system.A) >= 1.0:
            return None
    off, on = (_attitude_rms(problem, each, auto, spectrum, gain) for each in (None, observer))
    return off / on if np.isfinite(off) and 0.0 < on < np.inf else None


def weather_record(auto: AutoSpec) -> dict[str, object]:
    """The keys of an [auto] table that the findings depend on."""
    record: dict[str, object] = {
        **_shape_record(auto.spectrum),
        "noise_rms": auto.noise_rms,
        "least_disk_margin": auto.least_disk_margin,
        "largest_noise_in_correction": auto.largest_noise,
        "attitude_gain": auto.attitude_gain,
    }
    if auto.disturbance_rms is not None:
        record["disturbance_rms"] = auto.disturbance_rms
    if auto.largest_peak is not None:
        record["largest_noise_gain"] = auto.largest_peak
    if auto.moment_rate_hz is not None:
        record["moment_rate_hz"] = auto.moment_rate_hz
    return record


def recorded_weather(extra: Mapping[str, object], dt: float, where: str) -> AutoSpec | None:
    """What `weather_record` wrote into a certificate's `extra`; None where it holds none.

    Raises SpecError, one line that begins with `where`.
    """
    if WEATHER not in extra:
        return None
    return parse_auto(Table(f"{where}: {WEATHER}", extra[WEATHER]), 1.0 / dt)


def _shape_record(shape: Shape) -> dict[str, object]:
    if isinstance(shape, Band):
        return {"disturbance_band_hz": [shape.low_hz, shape.high_hz]}
    if isinstance(shape, Dryden):
        return {"disturbance_dryden": {"wind_m_s": shape.wind_m_s, "length_m": shape.length_m}}
    if isinstance(shape, Measured):
        return {"disturbance_spectrum": {"hz": list(shape.hz), "power": list(shape.power)}}
    if isinstance(shape, LowPass):
        return {"disturbance_corner_hz": shape.corner_hz}
    raise TypeError(f"a spectrum that no [auto] table states: {shape}")


def _taken(observer: Any, rates: int, auto: AutoSpec, disk_margin: float) -> Wanted:
    """The limits of [auto], each loosened as far as the observer needs; of several moments the noisiest counts."""
    K, direct = observer.B[:, :rates], observer.D[:, :rates]
    power = np.diag(observer.C @ gramian(observer.A, K) @ observer.C.T + direct @ direct.T)
    heard = largest(response(observer, np.linspace(0.0, np.pi, POINTS))[:, :, :rates])
    return Wanted(
        disk_margin=min(auto.least_disk_margin, disk_margin),
        noise=max(auto.largest_noise, auto.noise_rms * float(np.sqrt(np.max(power)))),
        noise_rms=auto.noise_rms,
        peak=None if auto.largest_peak is None else max(auto.largest_peak, float(np.max(heard))),
    )


def _attitude_rms(problem: Problem, observer: Any, auto: AutoSpec, spectrum: Spectrum, gain: float) -> float:
    angles = grid(POINTS)
    z = np.exp(1j * angles)[:, None, None]
    one = np.eye(len(problem.delays))
    integral = problem.dt / 2.0 * (z + 1.0) / (z - 1.0)
    G, C = gain * response(problem.plant, angles), response(problem.controller, angles)
    left, K_n, K = one + 0.0 * G, C, C * (1.0 + auto.attitude_gain * integral)
    if observer is not None:
        late = np.exp(-1j * np.outer(angles, problem.delays))[:, :, None]
        D = late * response(observer, angles)
        left, K_n, K = one + D[:, :, len(G[0]) :], C + D[:, :, : len(G[0])], K + D[:, :, : len(G[0])]
    held = integral * (G @ np.linalg.inv(left + K @ G))
    wind, hiss = spectrum.amplitude(angles, problem.dt), spectrum.hiss(angles, auto.noise_rms)
    return float(np.sqrt(_power(held @ left, wind) + _power(held @ K_n, hiss)))


def _power(values: Complex, amplitude: Array) -> float:
    return float(np.sum(np.sum(np.abs(values) ** 2, axis=(1, 2)) * amplitude**2))
