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
    proof = block.certificate
    if np.any(block.observer.D[:, len(block.axes) :] != 0.0):
        return "D has a direct path from u_e, expected exactly zero (it would close an algebraic loop)"
    rho = block.observer.spectral_radius
    holds = (
        ("spectral radius of the observer's A", rho, rho < 1.0, "below 1"),
        (
            "certified gamma",
            proof.gamma,
            proof.gamma <= proof.gamma_backoff * proof.gamma_star,
            f"at most {proof.gamma_backoff * proof.gamma_star:.6g} (gamma_backoff * gamma_star)",
        ),
        (
            "closed_loop_spectral_radius",
            proof.closed_loop_spectral_radius,
            proof.closed_loop_spectral_radius < 1.0,
            "below 1",
        ),
        (
            "command_leak",
            proof.command_leak,
            abs(proof.command_leak) <= GREATEST_COMMAND_LEAK,
            f"at most {GREATEST_COMMAND_LEAK:g}",
        ),
        ("disk_margin", proof.disk_margin, proof.disk_margin >= LEAST_DISK_MARGIN, f"at least {LEAST_DISK_MARGIN:g}"),
        (
            "delay_margin_samples",
            proof.delay_margin_samples,
            proof.delay_margin_samples >= LEAST_DELAY_MARGIN_SAMPLES,
            f"at least {LEAST_DELAY_MARGIN_SAMPLES}",
        ),
    )
    return next((f"{name} is {value:.6g}, expected {limit}" for name, value, fits, limit in holds if not fits), "")
