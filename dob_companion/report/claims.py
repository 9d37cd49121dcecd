"""A certificate in sentences: what was proved about a block, by which method, with the numbers."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from dob_companion.analysis.design import Verdicts, verdicts
from dob_companion.artifact import Certificate, DobBlock
from dob_companion.artifact.flyable import GREATEST_COMMAND_LEAK, LEAST_DISK_MARGIN
from dob_companion.lti.margins import MOST_DELAY_SAMPLES
from dob_companion.report.words import listed, number, plural


@dataclass(frozen=True, slots=True)
class Claim:
    """One sentence of the certificate and whether the recorded numbers bear it out."""

    holds: bool
    head: str
    text: str


def claims(block: DobBlock, dt: float) -> tuple[Claim, ...]:
    """The sentences of a block's certificate, from the numbers recorded in its file."""
    proof, found = block.certificate, verdicts(block)
    return (
        _near_optimal(proof, found),
        _stable(proof, found),
        Claim(
            found.no_algebraic_loop,
            "No algebraic loop.",
            "D(z) has no direct path from u_e: those columns of its D matrix are exactly zero.",
        ),
        Claim(
            found.deaf_to_commands,
            "Deaf to commands.",
            f"A command added to u reaches d_hat with a gain of at most {number(proof.command_leak, 2)} "
            f"(allowed {number(GREATEST_COMMAND_LEAK, 2)}), so a pilot's input is not mistaken for a disturbance.",
        ),
        _disk(proof, found),
        _delay(proof, found, dt),
        _bandwidth(proof, found),
    )


def further(extra: Mapping[str, object]) -> list[tuple[str, str]]:
    """What else the certificate records, as it stands: name and value of every number, word or list of numbers."""
    rows = []
    for name, value in extra.items():
        if isinstance(value, bool) or value is None:
            continue
        if isinstance(value, int | float):
            rows.append((name, number(float(value), 5) if isinstance(value, float) else str(value)))
        elif isinstance(value, str):
            rows.append((name, value))
        elif isinstance(value, list) and value and all(isinstance(one, float) for one in value):
            rows.append((name, listed(tuple(number(one, 5) for one in value))))
    return rows


def _near_optimal(proof: Certificate, found: Verdicts) -> Claim:
    return Claim(
        found.near_optimal,
        "Near-optimal.",
        f"γ = {number(proof.gamma, 6)}: the H∞ norm from (w_d, w_n) to d − z^−τ d_hat, measured "
        "on the stored matrices in the closed loop, not reported by the solver. No observer reaches less than "
        f"γ* = {number(proof.gamma_star, 6)} (lower bound: {proof.gamma_star_method}). "
        f"The ratio is {number(found.ratio, 5)}; {number(proof.gamma_backoff, 5)} was asked for.",
    )


def _stable(proof: Certificate, found: Verdicts) -> Claim:
    return Claim(
        found.stable,
        "Stable.",
        "Plant, controller, link delay and observer together have the spectral radius "
        f"{number(proof.closed_loop_spectral_radius, 6)}, the observer alone "
        f"{number(proof.observer_spectral_radius, 6)}: both below 1. The observer's slowest mode decays with a time "
        f"constant of {number(proof.slowest_mode_s * 1e3, 3, 'ms')}.",
    )


def _disk(proof: Certificate, found: Verdicts) -> Claim:
    least, most, phase = (number(value, 3) for value in (found.least_gain, found.most_gain, found.phase_deg))
    reach = f"gain errors from {least} to {most}" if math.isfinite(found.most_gain) else "any gain"
    off = proof.extra.get("disk_margin_off")
    beside = f", {number(off, 3)} without the observer" if isinstance(off, float) else ""
    return Claim(
        found.robust_in_gain_and_phase,
        "Robust in gain and phase.",
        f"Disk margin {number(proof.disk_margin, 3)} at u_e{beside} (at least {LEAST_DISK_MARGIN:g} to fly): the loop "
        f"bears {reach} and, apart from that, phase errors up to {phase}°.",
    )


def _delay(proof: Certificate, found: Verdicts, dt: float) -> Claim:
    unseen = _samples(proof.delay_margin_samples, dt)
    text = f"{unseen} of link delay that the observer is not told about leave the loop stable"
    useful = proof.extra.get("useful_delay_samples")
    if isinstance(useful, int):
        text += f"; it goes on helping with {_samples(useful, dt)} that u_e reports truly"
    return Claim(found.robust_in_delay, "Robust in delay.", text + ".")


def _samples(count: int, dt: float) -> str:
    least = "at least " if count >= MOST_DELAY_SAMPLES else ""
    return f"{least}{plural(count, 'further sample')} ({count * dt * 1e3:g} ms)"


def _bandwidth(proof: Certificate, found: Verdicts) -> Claim:
    hertz = proof.estimation_bandwidth_hz
    text = f"|1 − T| from d to d_hat stays below 0.707 up to {number(hertz, 3, 'Hz')}"
    attenuation = proof.extra.get("attenuation_bandwidth_hz")
    if isinstance(attenuation, float):
        text += f"; with the link's delay counted, up to {number(attenuation, 3, 'Hz')}"
    noise = proof.extra.get("noise_to_estimate_peak")
    if isinstance(noise, float) and noise > 0.0:
        text += f". Gyro noise reaches d_hat with at most {number(20.0 * math.log10(noise), 3, 'dB')}"
    return Claim(found.estimates_in_band, "Estimates in band.", text + ".")
