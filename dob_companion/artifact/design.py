"""What a finished design is: matrices, names, units and the proof that goes with them. numpy only."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from dob_companion.lti.statespace import StateSpaceData

AXES = ("roll", "pitch", "yaw")
"""Hover axes in wire order: roll about x, pitch about y, yaw about z (z down in hover)."""

LARGEST_DISTURBANCE = "largest_disturbance"
"""Name of a further finding of a certificate: what the block was asked to reject, normalized torque, of any axis."""

RATE_UNIT = "rad/s"
MOMENT_UNIT = "normalized torque"


@dataclass(frozen=True, slots=True)
class Problem:
    """The data that a design answers, discrete at the design's rate: u = C (r - y_n), w weighted at the inputs."""

    plant: StateSpaceData
    controller: StateSpaceData
    disturbance_weight: StateSpaceData
    noise_weight: StateSpaceData


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """What was proved about a block, recomputed from its exact matrices.

    gamma                        H-infinity norm (w_d, w_n) -> d - z^-tau d_hat
    gamma_star                   a lower bound on what any observer reaches, by `gamma_star_method`
    gamma_backoff                gamma <= gamma_backoff * gamma_star was asked for
    closed_loop_spectral_radius  of plant, controller, delay and observer together
    observer_spectral_radius     of the observer's A
    slowest_mode_s               -dt / ln(observer_spectral_radius)
    command_leak                 H-infinity norm of a command added to u -> d_hat
    disk_margin                  skew 0, loop broken at u_e
    delay_margin_samples         further whole samples of link delay until unstable
    estimation_bandwidth_hz      first frequency with |1 - T_d->d_hat| > 0.707
    extra                        further findings, by name; kept in the file, not needed to fly
    """

    gamma: float
    gamma_star: float
    gamma_star_method: str
    gamma_backoff: float
    closed_loop_spectral_radius: float
    observer_spectral_radius: float
    slowest_mode_s: float
    command_leak: float
    disk_margin: float
    delay_margin_samples: int
    estimation_bandwidth_hz: float
    extra: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class DobBlock:
    """One observer D(z): [all y_n; all u_e] -> d_hat, over `axes` in that order. The correction is -d_hat.

    y_n in rad/s, u_e and d_hat in normalized torque, hover axes.
    Raises ValueError when axes repeat, are unknown, or do not match the observer's inputs and outputs.
    """

    name: str
    axes: tuple[str, ...]
    delay_samples: int
    observer: StateSpaceData
    problem: Problem
    certificate: Certificate

    def __post_init__(self) -> None:
        unknown = [axis for axis in self.axes if axis not in AXES]
        if unknown or not self.axes or len(set(self.axes)) != len(self.axes):
            raise ValueError(f"axes {list(self.axes)} must be different ones of {', '.join(AXES)}")
        if self.delay_samples < 0:
            raise ValueError(f"delay_samples is {self.delay_samples}, expected 0 or more")
        outputs, inputs = self.observer.D.shape
        if (outputs, inputs) != (len(self.axes), 2 * len(self.axes)):
            raise ValueError(
                f"D is {outputs}x{inputs}, expected {len(self.axes)}x{2 * len(self.axes)} for axes {list(self.axes)}"
            )

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the observer's inputs, in order."""
        return tuple(f"y_n.{a}" for a in self.axes) + tuple(f"u_e.{a}" for a in self.axes)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the observer's outputs, in order."""
        return tuple(f"d_hat.{a}" for a in self.axes)


@dataclass(frozen=True, slots=True, kw_only=True)
class DobDesign:
    """Everything in a design.json. `sha256` is empty until the design was written or read."""

    dt: float
    delay_samples: int
    blocks: tuple[DobBlock, ...]
    created: str
    generator: str
    sha256: str = ""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.dt) and self.dt > 0):
            raise ValueError(f"dt is {self.dt}, expected a positive number of seconds")
        axes = [axis for block in self.blocks for axis in block.axes]
        if not axes or len(set(axes)) != len(axes):
            raise ValueError(f"blocks cover axes {axes}, expected each axis at most once and at least one")

    @property
    def limit(self) -> float | None:
        """Largest correction that the design asks for, normalized torque: the largest disturbance of its blocks.

        None where nothing is known: a block does not say, or says no number above 0 and at most 1.
        """
        stated = [block.certificate.extra.get(LARGEST_DISTURBANCE) for block in self.blocks]
        known = [float(v) for v in stated if isinstance(v, int | float) and v is not True and 0.0 < v <= 1.0]
        return max(known) if len(known) == len(stated) else None
