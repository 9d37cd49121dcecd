"""Whether a design may be flown: what `run` checks from the file alone, with numpy only.

Norms are not recomputed here (`dob-companion inspect` does that); what is cheap to verify from the
matrices is verified, and the rest is held to what the certificate recorded.
"""

import numpy as np

from dob_companion.artifact.design import DobBlock, DobDesign
from dob_companion.errors import DesignFileError

LEAST_DISK_MARGIN = 0.2
"""Below this the loop with the observer is too close to instability to arm with."""

LEAST_DELAY_MARGIN_SAMPLES = 1
"""A link is never exact to the sample: one more must not destabilize."""

GREATEST_COMMAND_LEAK = 1e-6
"""A pilot's command must not appear as a disturbance."""


def check_flyable(design: DobDesign, rate_hz: float, source: str = "design.json") -> None:
    """Raise DesignFileError, naming the block and the finding, unless `design` may fly at `rate_hz`."""
    if abs(design.dt * rate_hz - 1.0) > 1e-9:
        raise DesignFileError(f"{source}: dt is {design.dt:g} s, expected {1.0 / rate_hz:g} s ({rate_hz:g} Hz)")
    for block in design.blocks:
        reason = _unfit(block)
        if reason:
            raise DesignFileError(f"{source}: block {block.name!r}: {reason}")


def _unfit(block: DobBlock) -> str:
    proof, radius = block.certificate, block.observer.spectral_radius
    allowed = proof.gamma_backoff * proof.gamma_star
    if radius >= 1.0:
        return f"the observer is unstable: spectral radius of A is {radius:.6f}, expected below 1"
    if np.any(block.observer.D[:, len(block.axes) :] != 0.0):
        return "D has a direct path from u_e, expected exactly zero (it would close an algebraic loop)"
    if not proof.gamma <= allowed:
        return f"certificate failed: gamma is {proof.gamma:.6g}, expected at most {allowed:.6g} (gamma_backoff * gamma_star)"
    if not proof.closed_loop_spectral_radius < 1.0:
        return f"certificate failed: closed_loop_spectral_radius is {proof.closed_loop_spectral_radius:.6f}, expected below 1"
    if not abs(proof.command_leak) <= GREATEST_COMMAND_LEAK:
        return (
            f"certificate failed: command_leak is {proof.command_leak:.3g}, expected at most {GREATEST_COMMAND_LEAK:g}"
        )
    if not proof.disk_margin >= LEAST_DISK_MARGIN:
        return f"disk_margin is {proof.disk_margin:.3f}, expected at least {LEAST_DISK_MARGIN}"
    if not proof.delay_margin_samples >= LEAST_DELAY_MARGIN_SAMPLES:
        return f"delay_margin_samples is {proof.delay_margin_samples}, expected at least {LEAST_DELAY_MARGIN_SAMPLES}"
    return ""
