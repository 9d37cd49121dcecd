"""Why the zero of (11) lies outside the unit circle: `python -m sitl.sweep.sampling_zero` prints the numbers.

A rotor's moment follows its command by a lag, the body integrates it, and the computer holds its command for a sample:
G(s) = slope · e^{−s delay} / (s (1 + s lag)). Sampled exactly, a zero appears which is nowhere in G(s), near −1 without
delay (a double integrator's is at −1; Åström, Hagander and Sternby, "Zeros of sampled systems", Automatica 20 (1984)),
and every bit of delay moves it outwards.
"""

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq, least_squares

from sitl.airframe.linear import PITCH, RateAxis
from sitl.constants import DT
from sitl.sweep.estimate import Complexes, Response
from sitl.sweep.fit import BAND, Fit, fit_rate_axis
from sitl.sweep.multisine import Floats


def sampled(slope: float, lag: float, delay: float, dt: float = DT) -> tuple[Floats, Floats]:
    """Numerator and denominator in descending powers of z of slope · e^{−s delay} / (s (1 + s lag)) behind a hold.

    `slope` in rad/s² per unit, `lag` and `delay` in s, 0 ≤ delay < dt. Exact: within a sample the old input acts for
    `delay` and the new one for the rest, x(k+1) = Φ x(k) + Γ₁ u(k−1) + Γ₀ u(k) (Åström and Wittenmark,
    *Computer-Controlled Systems*, 3rd ed. 1997, on systems with time delays). Degrees 2 and 3: a pole at z = 0 holds
    the old input.
    """
    if not 0.0 <= delay < dt:
        raise ValueError(f"delay {delay:g} s; expected 0 or more and less than a sample of {dt:g} s")
    phi, _ = _held(slope, lag, dt)
    phi_new, gamma_new = _held(slope, lag, dt - delay)
    gamma_old = phi_new @ _held(slope, lag, delay)[1]
    b = [gamma_new[0], gamma_old[0]]  # rate after one sample, from the new and from the old input
    moved = [phi[0, 1] * gamma_new[1] - phi[1, 1] * gamma_new[0], phi[0, 1] * gamma_old[1] - phi[1, 1] * gamma_old[0]]
    return np.array([b[0], b[1] + moved[0], moved[1]]), np.polymul([1.0, -1.0, 0.0], [1.0, -phi[1, 1]])


def _held(slope: float, lag: float, time: float) -> tuple[Floats, Floats]:
    """Φ and Γ of the states (rate, moment) under an input held for `time`, s."""
    block = np.zeros((3, 3))
    block[0, 1], block[1, 1], block[1, 2] = slope, -1.0 / lag, 1.0 / lag
    block = expm(block * time)
    return block[:2, :2], block[:2, 2]


def response_of_sampled(slope: float, lag: float, delay: float, frequency: Floats, dt: float = DT) -> Complexes:
    """The exact sampled model's frequency response at these frequencies, rad/s."""
    num, den = sampled(slope, lag, delay, dt)
    z = np.exp(1j * frequency * dt)
    return np.asarray(np.polyval(num, z) / np.polyval(den, z))


def as_paper_fits(slope: float, lag: float, delay: float) -> Fit:
    """The form of (11) fitted to the exact sampled model over the paper's band, relative errors weighted evenly."""
    frequency = np.geomspace(*BAND, 100)
    value = response_of_sampled(slope, lag, delay, frequency)
    ones = np.ones_like(frequency)
    return fit_rate_axis(Response(frequency, value, np.abs(value), ones, ones))


def behind(model: RateAxis) -> tuple[float, float, float]:
    """Slope (rad/s² per unit), lag (s) and delay (s) whose fit in the form of (11) is `model`."""
    slope = model.gain * (1.0 - model.zero) / (1.0 - model.pole) / DT

    def error(p: Floats) -> list[float]:
        found = as_paper_fits(slope * p[0], *(1e-3 * p[1:])).model
        return [found.gain / model.gain - 1.0, found.zero / model.zero - 1.0, found.pole / model.pole - 1.0]

    start = [1.0, -1e3 * DT / np.log(model.pole), 0.5]  # lag and delay in ms
    p = least_squares(error, start, bounds=([0.1, 1.0, 0.0], [10.0, 1e3, 1e3 * DT * 0.99]), xtol=1e-14).x
    return float(slope * p[0]), float(1e-3 * p[1]), float(1e-3 * p[2])


def delay_of_zero(zero: float, lag: float) -> float:
    """The delay, s, that puts the exact sampled model's outer zero at `zero`."""

    def error(delay: float) -> float:
        return float(np.roots(sampled(1.0, lag, delay)[0]).real.min()) - zero

    return float(brentq(error, 0.0, 0.9 * DT))


def main() -> None:
    """Print the numbers of docs/identification.md."""
    slope, lag, delay = behind(PITCH)
    print(f"(11) is, over {BAND[0]:g} to {BAND[1]:g} rad/s: {slope:.0f} rad/s² per unit, lag {1e3 * lag:.1f} ms, "
          f"delay {1e3 * delay:.3f} ms = {delay / DT:.3f} sample")  # fmt: skip
    exact = delay_of_zero(PITCH.zero, lag)
    print(f"the exact model's outer zero is at {PITCH.zero} for a delay of {1e3 * exact:.3f} ms")
    print("\n| delay, ms | exact zeros | zero of the form (11) | its pole | its gain | worst misfit |")
    print("| --- | --- | --- | --- | --- | --- |")
    for d in (0.0, 2e-4, 4e-4, delay, 6e-4, 8e-4, 1e-3):
        zeros = np.sort(np.roots(np.trim_zeros(sampled(slope, lag, d)[0], "b")).real)
        fit = as_paper_fits(slope, lag, d)
        m = fit.model
        print(f"| {1e3 * d:.2f} | {', '.join(f'{zero:.3f}' for zero in zeros)} | {m.zero:.3f} | {m.pole:.4f} | "
              f"{m.gain:.5f} | {fit.worst:.1e} |")  # fmt: skip


if __name__ == "__main__":
    main()
