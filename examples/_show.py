"""Prints the certificate of a synthesis and draws it: `show(name, result)` at the end of each example.

The picture goes to example_NAME.svg in the folder named on the command line, made when it is missing, or in the current
one.
"""

import argparse
import sys
from pathlib import Path

import control as ct
import numpy as np

from dob_companion.errors import InputError
from dob_companion.files import require_place, write_files
from dob_companion.lti.response import gains
from dob_companion.report.chart import Chart, Curve, Panel, Scale, rounded
from dob_companion.report.draw import standalone
from dob_companion.synthesis.plant.loop import close_loop

GUST = 0.1
"""Peak of the gust ½ (1 − cos 2πt) that lasts 1 s, in the unit of the plant's input."""


def folder():
    """Where pictures go. Ends the program with one line when nothing can be written there."""
    parser = argparse.ArgumentParser(description="Design an observer, print its certificate, draw what it does.")
    parser.add_argument("folder", nargs="?", type=Path, default=Path(), metavar="DIR", help="for the picture (.)")
    place = parser.parse_args().folder
    try:
        require_place(place)
    except InputError as problem:
        sys.exit(str(problem))
    return place


def show(name, result, panel=None):
    """Print the certificate; draw the error left and beside it `panel`, or the response to a gust on every axis."""
    proof = result.certificate
    print(f"gamma                  {proof.gamma:.4g}, certified at most {proof.gamma_backoff:g} times gamma_star")
    print(f"gamma_star             {proof.gamma_star:.4g}, no observer does better")
    print(f"observer order         {result.observer.nstates}, slowest mode {1e3 * proof.slowest_mode_s:.3g} ms")
    print(f"estimation bandwidth   {proof.estimation_bandwidth_hz:.3g} Hz")
    print(f"disk margin            {proof.disk_margin:.3g}, {proof.extra['disk_margin_off']:.3g} without the observer")
    print(f"delay margin           {proof.delay_margin_samples} samples")
    print(f"command leak below     1e-06: {proof.command_leak < 1e-6}")
    panels = (_error_left(result), panel or _gust(result))
    chart = Chart(f"example-{name}", f"{name}: error left, and response", panels, 900, 340, col_widths=(1.0, 1.0))
    try:
        write_files(folder(), {f"example_{name}.svg": standalone(chart)})
    except InputError as problem:
        sys.exit(str(problem))


def _error_left(result):
    """Largest singular value of (d -> d − z^−τ d_hat) W_d: what gamma bounds, and the same with the observer off."""
    problem = result.problem
    loop = close_loop(problem.plant, problem.controller, result.observer, problem.delays)
    hertz = np.geomspace(1e-3 / problem.dt, 0.5 / problem.dt, 500)
    angles = 2 * np.pi * hertz * problem.dt
    on = _db(gains(loop.part("error", "d") * problem.disturbance_weight, angles))
    off = _db(gains(problem.disturbance_weight, angles))
    level = _db(np.full_like(hertz, result.certificate.gamma))
    low, high = rounded([on, off, level], 10.0)
    curves = (
        Curve("γ", hertz, level, "bound", width=4.0),
        Curve("observer off", hertz, off, "off"),
        Curve("observer on", hertz, on, "on"),
    )
    x = Scale("frequency", "Hz", float(hertz[0]), float(hertz[-1]), log=True)
    return Panel(0, 0, x, Scale("error left, times W_d", "dB", max(low, high - 70), high), curves)


def _gust(result):
    problem = result.problem
    t = np.arange(round(2.0 / problem.dt)) * problem.dt
    d = np.tile(np.where(t < 1.0, GUST / 2 * (1 - np.cos(2 * np.pi * t)), 0.0), (problem.plant.ninputs, 1))
    curves = []
    for observer, name, role in ((None, "observer off", "off"), (result.observer, "observer on", "on")):
        loop = close_loop(problem.plant, problem.controller, observer, problem.delays)
        rates = ct.forced_response(loop.part("y", "d"), timepts=t, inputs=d, squeeze=False).outputs
        for i, rate in enumerate(rates):
            curves.append(Curve("" if i else name, t, rate, role, dashed=i == 1, width=1.6 if i < 2 else 0.8))
    values = [curve.y for curve in curves]
    limits = rounded(values, 10.0 ** np.floor(np.log10(np.ptp(np.concatenate(values)))) / 5)
    title = "" if len(rates) == 1 else "first axis solid, second dashed, third thin"
    y = Scale("gust response", "rad/s", *limits)
    return Panel(0, 1, Scale("time", "s", 0.0, 2.0), y, tuple(curves), title=title)


def _db(values):
    return 20 * np.log10(np.maximum(values, 1e-12))


folder()  # a wrong command line is told before the work, not after
