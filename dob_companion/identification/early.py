"""Whether the rate answers before the moment: no aircraft does, so the stamps of one of them are wrong.

A model has no negative delay, and without one a lead or a missing lag stands in for it, at the cost of the fit. Here
the rate is put off by AHEAD_S, so that the delay may be less than that, and fitted anew.
"""

from dataclasses import replace

import numpy as np

from dob_companion.identification.fit import DELAY, INSIST, SHARED, Fit, fit, rigid

AHEAD_S = 0.05
NONE_S = 2e-3
"""A delay above this is one."""
WITHIN = 0.5
"""Of a sample: so early a rate may seem to be that is read between two moments."""

NORMAL_95 = 1.96


def doubt(richest: Fit) -> str:
    """Why this model cannot be an aircraft's; "" where it can."""
    if richest.parameters[DELAY] > NONE_S:
        return ""
    data = richest.data
    turn = np.exp(-1j * data.frequency * AHEAD_S)
    late = replace(data, value=data.value * turn, rest=data.rest * turn)
    start = richest.parameters.copy()
    start[DELAY] += AHEAD_S
    scatter, points = max(1.0, richest.chi2), float(np.log(2.0 * len(data.frequency)))

    def criterion(one: Fit) -> float:
        """BIC: modes that are none stand in for what is early as well, at many parameters."""
        return one.squares / scatter + points * len(one.free)

    moved = min(rigid(late), fit(late, richest.free, start), key=criterion)
    if criterion(richest) - criterion(moved) < INSIST:
        return ""
    delay, latest = float(moved.parameters[DELAY]) - AHEAD_S, -WITHIN * data.dt
    rest = tuple(k for k in moved.free if k != DELAY)
    there = fit(late, rest, moved.parameters, fixed={DELAY: AHEAD_S + latest}, apart=True)
    if delay > latest or there.squares - moved.squares < SHARED * max(1.0, moved.chi2) * NORMAL_95**2:
        return ""
    early = f"the gyro answers {-1e3 * delay:.0f} ms before the moment that turns the aircraft"
    return f"{early}: one of the two bears wrong stamps"
