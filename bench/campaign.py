"""A campaign flight in one process: vehicle, companion with limit and ramp, recorder; against the bare vehicle.

All times but the last table's are processor time of one core; a flight and the bare vehicle by turns. The bare vehicle
meets the same disturbance without a companion and without a record.
"""

import os
import time
from collections.abc import Iterator

import numpy as np

from bench._peers import paper_design
from dob_companion.artifact import dumps
from sitl.campaign import fleet
from sitl.campaign.pilot import Craft, Job, aircraft_of, fly_row
from sitl.campaign.plan import Inputs
from sitl.constants import DT
from sitl.flight import Flight
from sitl.scenario.spec import load

SCENARIO = "paper"
DISTURBANCE = (0.02, 0.02, 0.02)
"""Normalized torque rms. How strong it is makes no difference in cost; so it need not be searched for."""

TURNS = int(os.environ.get("BENCH_TURNS", "3"))
COUNTS = (1, 2, 4, 8)
TOGETHER_S = 10.0
"""Length of the flights flown together, s: the beginning of the scenario, climb included."""

FLIGHTS = 8


def measure() -> Iterator[str]:
    """Speed of whole flights by airframe; cost against their number; what processes side by side come to."""
    design = dumps(paper_design())[0]
    load_now = f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    yield f"whole flights of {SCENARIO!r} on one core, best of {TURNS}, {load_now}"
    heads = ("µs a sample", "x real time", "flights/s", "bare, µs", "bare, x", "ratio")
    yield f"{'airframe':12}" + "".join(f"{head:>12}" for head in heads)
    for airframe in ("linear", "tailsitter"):
        yield _speed(_job(airframe, design))
    yield from _against_number(_job("linear", design))
    yield from _side_by_side(_job("linear", design))


def _job(airframe: str, design: str) -> Job:
    return Job(Inputs(0, 1, airframe, "paper", 1, 1.0, 1.0), load(SCENARIO), DISTURBANCE, design, {})


def _speed(job: Job) -> str:
    _bare(job, 1000)  # whatever is compiled is compiled now
    flights, bare, samples = [], [], 0
    for _ in range(TURNS):
        begin = time.process_time()
        row = fly_row(job)
        flights.append(time.process_time() - begin)
        assert row["outcome"] == "complete", row["reason"]
        samples = round(row["flown_s"] / DT)
        bare.append(_bare(job, samples))
    best, best_bare = min(flights), min(bare)
    return (
        f"{job.inputs.airframe:12}{1e6 * best / samples:>12.1f}{samples * DT / best:>12.0f}{1.0 / best:>12.2f}"
        f"{1e6 * best_bare / samples:>12.1f}{samples * DT / best_bare:>12.0f}{best / best_bare:>12.2f}"
    )


def _bare(job: Job, samples: int) -> float:
    """Processor time of as many samples of the vehicle alone."""
    flight = Flight(job.scenario, 1, job.scale, aircraft=aircraft_of(job.inputs), record=False)
    begin = time.process_time()
    for _ in range(samples):
        flight.step()
    return time.process_time() - begin


def _against_number(job: Job) -> Iterator[str]:
    """Several vehicles flown sample by sample in turn: does each cost what one costs alone?"""
    yield f"the first {TOGETHER_S:g} s of several vehicles, sample by sample in turn, on one core"
    yield f"{'vehicles':>12}{'s':>8}{'s each':>8}"
    costs = np.array([min(_together(job, count) for _ in range(TURNS)) for count in COUNTS])
    for count, cost in zip(COUNTS, costs, strict=True):
        yield f"{count:>12}{cost:>8.2f}{cost / count:>8.3f}"
    slope = float(np.linalg.lstsq(np.array(COUNTS)[:, None], costs, rcond=None)[0][0])
    off = np.max(np.abs(slope * np.array(COUNTS) / costs - 1.0))
    yield f"a line through zero, {slope:.3f} s a vehicle, fits all within {off:.0%}"


def _together(job: Job, count: int) -> float:
    crafts = [Craft(job) for _ in range(count)]
    begin = time.process_time()
    for _ in range(round(TOGETHER_S / DT)):
        for craft in crafts:
            craft.step()
    return time.process_time() - begin


def _side_by_side(job: Job) -> Iterator[str]:
    """Wall time of flights on several processes, from the first row on: the start of a process is not in it."""
    yield f"{FLIGHTS} flights on several processes of this computer, wall time from the first row to the last"
    yield f"{'processes':>12}{'flights/s':>11}"
    for processes in range(1, (os.cpu_count() or 1) + 1):
        times = []
        for rows in fleet.local([job] * (FLIGHTS + processes), processes):
            times += [time.perf_counter()] * len(rows)
        yield f"{processes:>12}{(len(times) - 1) / (times[-1] - times[0]):>11.2f}"
