"""What the pages are tested on: the paper's design, a coupled one, and a short flight with known numbers."""

import io
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import control as ct
import numpy as np

from dob_companion.artifact import DobBlock, DobDesign, Problem, dumps
from dob_companion.report.design_page import design_page
from dob_companion.report.flight_page import flight_page
from dob_companion.report.trace import FlightTrace
from dob_companion.synthesis.design import design, synthesize
from dob_companion.synthesis.plant.models import to_data
from dob_companion.synthesis.spec.parse import parse_spec

SPEC = Path(__file__).parents[2] / "examples" / "tailsitter_paper.toml"
HOSTILE = '<script>alert("x")</script>&$\\frac{'


@cache
def paper_design() -> DobDesign:
    """The three axes of the example, designed and sealed."""
    made = design(parse_spec(SPEC.read_text(encoding="utf-8"), SPEC.name))
    return dumps(replace(made, created="2026-11-22T12:00:00Z"))[1]


@cache
def coupled_design() -> DobDesign:
    """Roll and pitch in one block, a tenth of each moment acting on the other axis."""
    dt = 0.004
    G = ct.ss(ct.zpk([-1.716], [1.0, 0.9447], 0.14131, dt))
    plant = ct.append(G, G) * ct.ss([], [], [], [[1.0, 0.1], [0.1, 1.0]], dt)
    pair = [
        ct.append(one, one)
        for one in (
            ct.ss(ct.zpk([0.8343, 0.9987], [0.0, 1.0], 0.9002, dt)),
            ct.ss(ct.zpk([-0.8997], [0.9962], 0.19908, dt)),
            ct.ss(ct.zpk([0.9949], [-0.925], 3.7584, dt)),
        )
    ]
    made = synthesize(plant, *pair, axes=("roll", "pitch"))
    problem = made.problem
    block = DobBlock(
        name="roll and pitch together",
        axes=("roll", "pitch"),
        delay_samples=1,
        observer=to_data(made.observer),
        problem=Problem(
            plant=to_data(problem.plant),
            controller=to_data(problem.controller),
            disturbance_weight=to_data(problem.disturbance_weight),
            noise_weight=to_data(problem.noise_weight),
        ),
        certificate=made.certificate,
    )
    return DobDesign(
        dt=dt, delay_samples=1, blocks=(block,), created="2026-11-22T12:00:00Z", generator="dob-companion test"
    )


def one_block(**proof: Any) -> DobDesign:
    """The first axis of the paper's design alone, its certificate changed as named."""
    good = paper_design()
    block = good.blocks[0]
    return replace(good, blocks=(replace(block, certificate=replace(block.certificate, **proof)),))


def hostile_design() -> DobDesign:
    """One axis with every free text of the file turned against the page."""
    bad = one_block(gamma_star_method=HOSTILE, extra={HOSTILE: HOSTILE, "note": HOSTILE})
    return replace(bad, blocks=(replace(bad.blocks[0], name=HOSTILE),), created=HOSTILE, generator=HOSTILE)


@cache
def design_html() -> str:
    """The page of the paper's design."""
    return design_page(paper_design())


@cache
def coupled_html() -> str:
    """The page of the coupled design."""
    return design_page(coupled_design())


@cache
def hostile_html() -> str:
    """The page of the hostile design."""
    return design_page(hostile_design())


@cache
def flight_html() -> str:
    """The page of the short flight."""
    return flight_page(paper_design(), result(), trace())


def arrays(window_s: float = 6.0) -> dict[str, Any]:
    """flight.npz's arrays: a window off, a still pause, a window on in which the error is an eighth."""
    dt, pause = 0.004, 500
    n = round(window_s / dt)
    count = 2 * n + pause
    t = np.arange(count) * dt
    window = np.zeros(count, np.int8)
    window[:n], window[-n:] = 1, 2
    moving = (window != 0)[:, None]
    on = (window == 2)[:, None]
    waves = np.sin(2.0 * np.pi * t[:, None] * np.array([0.7, 0.9, 1.1]) + np.array([0.0, 1.0, 2.0]))
    d = 0.2 * waves * moving
    return {
        "stamp_us": 1_000_000 + 4000 * np.arange(count, dtype=np.int64),
        "window": window,
        "rate": waves * 0.3,
        "gyro": waves * 0.3,
        "u_e": -d,
        "correction": np.where(on, -0.98 * d, 0.0),
        "disturbance": d,
        "attitude_error": 0.12 * waves * moving * np.where(on, 0.125, 1.0),
        "age": np.ones(count, np.int16),
        "quaternion": np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
        "answered": np.ones(count, bool),
    }


def npz(**changed: Any) -> bytes:
    """The arrays as the bytes of an .npz; a value of None leaves an array out."""
    out = io.BytesIO()
    np.savez(out, **{name: value for name, value in (arrays() | changed).items() if value is not None})
    return out.getvalue()


@cache
def trace() -> FlightTrace:
    """The short flight, parsed."""
    return FlightTrace.from_bytes(npz())


def result() -> dict[str, Any]:
    """A result.json whose numbers differ from each other everywhere, so that a swapped cell shows."""
    names = ("peak_off", "peak_on", "rms_off", "rms_on", "peak_ratio", "rms_ratio")
    axes = {
        axis: {name: (0.01 + 0.1 * k) * (1.0 + 0.37 * i) for k, name in enumerate(names)} | {"paper_ratio": paper}
        for i, (axis, paper) in enumerate((("roll", 7.5), ("pitch", 12.0), ("yaw", 6.0)))
    }
    return {
        "schema": "dob-companion/flight-result/1",
        "scenario": "paper",
        "seed": 7,
        "clock": "lockstep",
        "rate_hz": 249.87,
        "delay_samples": 2,
        "samples": 15000,
        "samples_lost": 3,
        "axes": axes,
    }
