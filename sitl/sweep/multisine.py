"""The excitation: sums of sines that fit a whole number of times into one period. Pure.

A periodic signal leaves no leakage in the spectra of whole periods, and random phases drawn anew for each realization
turn what a mildly nonlinear vehicle adds into something that averages out and shows in the variance (Pintelon and
Schoukens, *System Identification: A Frequency Domain Approach*, 2nd ed., Wiley/IEEE 2012: random-phase multisines and
the best linear approximation).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sitl.constants import DT

Floats = NDArray[np.float64]
Lines = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Plan:
    """What is sent on one axis.

    `realizations` signals of `period` samples, each preceded by the last `lead` samples of its own periodic
    continuation, which are left out: by then the loop's transients are gone (the slowest, PID (12)'s zero at 0.9987,
    takes 3.1 s). `rms` is in normalized torque. Lines are `density` per factor of e, and never closer than 2π/period;
    their amplitudes are equal well above `corner` and 1 + `boost` times as large well below, where attitude feedback
    leaves little of them in u_e. `highest` and `corner` are in rad/s. The default period, 3125 samples or 12.5 s, puts
    its first line at 0.503 rad/s.
    """

    realizations: int = 8
    period: int = 3125
    lead: int = 3000
    rms: float = 0.03
    highest: float = 620.0
    density: float = 85.0
    corner: float = 8.0
    boost: float = 15.0

    @property
    def samples(self) -> int:
        """Length of the whole excitation."""
        return self.realizations * (self.lead + self.period)

    @property
    def lines(self) -> Lines:
        """Excited harmonics of the period, ascending: spaced evenly in log frequency, rounded, each once."""
        last = int(self.highest * DT * self.period / (2.0 * np.pi))
        steps = np.arange(0.0, np.log(last), 1.0 / self.density)
        return np.unique(np.round(np.exp(steps)).astype(np.int64))

    @property
    def frequencies(self) -> Floats:
        """The lines in rad/s."""
        return np.asarray(self.lines * (2.0 * np.pi / (self.period * DT)), float)


FLEXIBLE = Plan(rms=0.04, boost=5.0)
"""More of high frequencies, where a rigid body hardly answers and flexible modes are."""


def realize(plan: Plan, rng: np.random.Generator) -> Floats:
    """One realization, shape (lead + period,): phases uniform on the circle."""
    amplitudes = 1.0 + plan.boost / (1.0 + (plan.frequencies / plan.corner) ** 2)
    spectrum = np.zeros(plan.period // 2 + 1, complex)
    spectrum[plan.lines] = amplitudes * np.exp(2j * np.pi * rng.random(len(plan.lines)))
    period: Floats = np.fft.irfft(spectrum, plan.period)
    period *= plan.rms / np.sqrt(np.mean(period**2))
    return period[np.arange(-plan.lead, plan.period) % plan.period]


def excitation(plan: Plan, seed: int) -> Floats:
    """All realizations, one after another, shape (samples,), normalized torque."""
    rng = np.random.default_rng(seed)
    return np.concatenate([realize(plan, rng) for _ in range(plan.realizations)])


def measured(plan: Plan, signal: Floats) -> Floats:
    """The parts of a record of the whole excitation that count, shape (realizations, period)."""
    return signal.reshape(plan.realizations, plan.lead + plan.period)[:, plan.lead :]
