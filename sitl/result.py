"""What a flight leaves behind: `result.json` and `flight.npz`, written whole or not at all."""

import io
import json
import os
from pathlib import Path
from statistics import median_low
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitl.constants import AXES
from sitl.figures import figure
from sitl.flight import Flight
from sitl.log import OFF_WINDOW, ON_WINDOW, Arrays
from sitl.scenario.checks import Verdict, judge, peak, rms
from sitl.scenario.spec import Scenario

SCHEMA = "dob-companion/flight-result/1"


def summarize(scenario: Scenario, seed: int, clock: str, arrays: Arrays) -> dict[str, Any]:
    """The content of `result.json` for a flight with both windows; deterministic, without times of day."""
    window, stamps, age = (arrays[name].astype(np.int64) for name in ("window", "stamp_us", "age"))
    in_windows = window > 0
    ages = age[in_windows & (age >= 0)]
    error = arrays["attitude_error"].astype(float)
    off, on = error[window == OFF_WINDOW], error[window == ON_WINDOW]
    off_stamps = stamps[window == OFF_WINDOW]
    ratios = scenario.paper_ratio or (None, None, None)
    return {
        "schema": SCHEMA,
        "scenario": scenario.name,
        "seed": seed,
        "clock": clock,
        "rate_hz": round(float(1e6 * (len(off_stamps) - 1) / (off_stamps[-1] - off_stamps[0])), 6),
        "delay_samples": int(median_low(ages.tolist())) if len(ages) else None,
        "samples": int(in_windows.sum()),
        "samples_lost": int((in_windows & ~arrays["answered"].astype(bool)).sum()),
        "axes": {name: _axis(off[:, i], on[:, i], ratios[i]) for i, name in enumerate(AXES)},
    }


def _axis(off: NDArray[np.float64], on: NDArray[np.float64], paper_ratio: float | None) -> dict[str, float | None]:
    peak_off, rms_off, peak_on, rms_on = peak(off), rms(off), peak(on), rms(on)
    return {
        "peak_off": peak_off,
        "peak_on": peak_on,
        "rms_off": rms_off,
        "rms_on": rms_on,
        "peak_ratio": peak_off / peak_on if peak_on else None,
        "rms_ratio": rms_off / rms_on if rms_on else None,
        "paper_ratio": paper_ratio,
    }


def verdicts(flight: Flight) -> list[Verdict]:
    """What the scenario's checks say of a complete flight."""
    return judge(flight.scenario.checks, flight.log.arrays(), flight.delay_samples)


def write(flight: Flight, clock: str, directory: Path, *, drawn: bool = False) -> None:
    """Write `flight.npz`, and `result.json` last if there are windows to compare, into `directory`.

    The directory is made when it is missing; a result of an earlier flight does not outlive that flight's record. When
    it is to be `drawn`, `figure.png` lies beside it; raises ModuleNotFoundError, with all else written, without
    matplotlib.
    """
    arrays = flight.log.arrays()
    directory.mkdir(parents=True, exist_ok=True)
    for name in ("result.json", "figure.png"):
        (directory / name).unlink(missing_ok=True)
    packed = io.BytesIO()
    np.savez_compressed(packed, **arrays)  # type: ignore[arg-type]
    _replace(directory / "flight.npz", packed.getvalue())
    if flight.complete:
        result = summarize(flight.scenario, flight.seed, clock, arrays)
        result["checks"] = [verdict.as_json() for verdict in verdicts(flight)]
        text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
        _replace(directory / "result.json", text.encode())
        if drawn:
            _replace(directory / "figure.png", figure(flight.scenario, arrays))


def _replace(path: Path, content: bytes) -> None:
    """Write beside and rename, so that a reader never sees half a file."""
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    beside.write_bytes(content)
    beside.replace(path)
