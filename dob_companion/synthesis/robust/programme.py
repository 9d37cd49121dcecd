"""A robust observer of one axis by the convex programme: the best in its weather that every plant of the set bears.

The set that is kept stable is the stated one made wider by WIDER, or by as much as the loop without observer bears, for
no observer bears more: a bound over frequency at each frequency by itself. Its plants enter as factors of the model
(`optimal/factors.py`): all vertices. What lies between them is proved afterwards, by `analysis`, and where the proof
falls short of what was asked the search is repeated with random plants from inside the set.
"""

from dataclasses import dataclass, replace
from typing import Any

import control as ct
import numpy as np

from dob_companion.artifact import Certificate
from dob_companion.errors import UnsolvableError
from dob_companion.lti.response import response
from dob_companion.synthesis.certify.certificate import Claim, certify
from dob_companion.synthesis.optimal.asked import spectrum_of, wanted_of
from dob_companion.synthesis.optimal.factors import ROOM, Factors
from dob_companion.synthesis.optimal.problem import Axis, Responses
from dob_companion.synthesis.optimal.realization import weights
from dob_companion.synthesis.optimal.search import Search, allowed_order
from dob_companion.synthesis.plant.models import zpk
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.robust.analysis import FACTOR_STEP, SEED, safe_factor
from dob_companion.synthesis.robust.cells import factor_system, samples
from dob_companion.synthesis.solve.optimum import find_optimum
from dob_companion.synthesis.spec.auto import AutoSpec
from dob_companion.synthesis.spec.uncertainty import Uncertainty

WIDER = 2.0
"""The classical margin: twice what was stated."""

INSIDE = (0, 12)
"""Random plants beside the vertices."""

STEPS = 12
"""Sizes tried where the stated set, uniformly wider, is more than the loop without observer bears."""

SLACK = 1.001
"""The search keeps clear of the limits by this factor, which a grid of angles takes."""

BACKOFF = 1.0003
"""How near to gamma* of its own weights the observer is certified; a solver tells gamma* to 1e-5."""


@dataclass(frozen=True, slots=True, eq=False)
class Made:
    """The observer, and the problem whose weights it is H-infinity optimal for."""

    problem: Problem
    observer: Any
    certificate: Certificate


def programmed(asked: Problem, uncertainty: Uncertainty, auto: AutoSpec, largest_order: int | None) -> Made:
    """The best observer for [auto]'s weather and limits that the widened set bears.

    `asked` gives plant, controller and delay, of one axis. Raises UnsolvableError when nothing keeps the limits, and as
    `find_optimum` and `certify` do.
    """
    axis = Axis.of(asked.plant, asked.controller, asked.delays[0], auto.attitude_gain)
    most = allowed_order(axis, largest_order)
    search = Search(axis, spectrum_of(auto), most)
    width = borne(asked, uncertainty)
    wanted = wanted_of(auto, SLACK)
    best: tuple[float, Any] | None = None
    for inside in INSIDE:
        search.factors = factors(search.on, uncertainty, width, inside)
        found = search.best(wanted)
        if found is None or found.solved.value >= 1.0:
            break
        observer = found.observer(axis)
        safe = safe_factor(asked, observer, uncertainty, width)
        if best is None or safe > best[0]:
            best = safe, observer
        if safe >= width * (1.0 - FACTOR_STEP):
            break
    if best is None:
        bears = " (without observer the loop bears no more)" if width < WIDER else ""
        raise UnsolvableError(
            f"no observer of at most {search.order} states keeps the limits of [auto] and bears {width:.3g} times the "
            f"stated uncertainty{bears}"
        )
    return _certified(asked, axis, best[1])


def borne(asked: Problem, uncertainty: Uncertainty) -> float:
    """How many times the stated set the loop without observer is proved to bear, at most WIDER."""
    m, p = len(asked.delays), asked.plant.D.shape[0]
    off = ct.ss([], [], [], np.zeros((m, p + m)), asked.dt)
    return safe_factor(asked, off, uncertainty, WIDER)


def factors(on: Responses, uncertainty: Uncertainty, width: float, inside: int) -> Factors:
    """The vertices of the set, `width` times as wide, and some random plants of it."""
    wide = uncertainty.scaled(width)
    if wide is None:
        raise UnsolvableError(f"{width:.3g} times the stated uncertainty holds plants that are none")
    channel = wide.channels[0]
    phi = [response(factor_system(wide, one, on.dt), on.angles)[:, 0, 0] for one in samples(wide, inside, SEED)]
    hertz = on.angles / (2.0 * np.pi * on.dt)
    if not channel.multiplicative:
        return Factors(np.array(phi), np.zeros(len(hertz)))
    bound = np.asarray(np.interp(hertz, channel.frequency_hz, channel.multiplicative), dtype=np.float64)
    return _widened(Factors(np.array(phi), bound), on, WIDER / width)


def _widened(wide: Factors, on: Responses, most: float) -> Factors:
    """The bound up to `most` times as large at each frequency by itself, where the loop without observer bears it: what
    it does not bear at one says nothing of another."""
    bound = wide.bound
    for more in np.linspace(1.0, most, STEPS)[1:]:
        larger = more * wide.bound
        bound = np.where(replace(wide, bound=larger).apart(on) > ROOM, larger, bound)
    return replace(wide, bound=bound)


def _certified(asked: Problem, axis: Axis, observer: Any) -> Made:
    own = weights(axis, observer)
    if own is None:
        raise UnsolvableError("the observer found has no weights of its own: d - z^-τ d_hat has a zero outside")
    W_d, W_n = (zpk(form.zeros, form.poles, form.gain, asked.dt) for form in (own.disturbance, own.noise))
    problem = replace(asked, disturbance_weight=W_d, noise_weight=W_n)
    optimum = find_optimum(problem)
    return Made(problem, observer, certify(problem, observer, Claim(optimum.gamma_star, optimum.method, BACKOFF)))
