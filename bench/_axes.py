"""The axes of `python -m bench optimal`: what each is, and what is asked of its observer."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from dob_companion.comparison.flight import DISTURBANCE_HZ, NOISE_SIGMA
from dob_companion.synthesis import parse_spec
from dob_companion.synthesis.spec.auto import AutoSpec
from dob_companion.synthesis.spec.parse import BlockSpec
from dob_companion.synthesis.spec.spectrum import LowPass

EXAMPLES = Path(__file__).parents[1] / "examples"

RMS = {"pitch": 0.0537, "roll": 0.0390, "yaw": 0.0451}
"""Of the disturbance, normalized torque: the peaks of the paper's Section IV, in the mean of 20 seeds."""

LIMITS = {
    ("pitch", 0): (0.4028, 3.000e-4, 2),
    ("roll", 0): (0.4128, 1.080e-3, 2),
    ("yaw", 0): (0.9349, 4.097e-4, 2),
    ("pitch", 1): (0.4002, 2.997e-4, 2),
    ("roll", 1): (0.4119, 1.075e-3, 2),
    ("yaw", 1): (0.8822, 4.107e-4, 2),
    ("pitch", 2): (0.3812, 3.010e-4, 2),
    ("roll", 2): (0.3669, 1.017e-3, 2),
    ("yaw", 2): (0.8158, 5.171e-4, 2),
    ("pitch", 3): (0.3809, 3.011e-4, 2),
    ("roll", 3): (0.3599, 9.951e-4, 2),
    ("yaw", 3): (0.7430, 5.280e-4, 2),
}
"""(axis, samples of link delay): least disk margin, largest RMS of noise in the correction, least delay margin. They
are what weights searched by hand had reached on the tail-sitter."""

FLOWN = (("ardupilot_copter", "roll"), ("ardupilot_copter", "yaw"), ("px4_sih", "roll"), ("px4_sih", "yaw"))
"""Examples of stock autopilots, each axis with what its [auto] asks."""

HEAD = "[design]\nrate_hz = 250.0\ndelay_samples = 1\n"

OTHERS = {
    "flexible: modes at 60 and 80 rad/s": """
[auto]
disturbance_corner_hz = 1.0
disturbance_rms = 0.05
noise_rms = 4e-4
least_disk_margin = 0.4
largest_noise_in_correction = 1e-3
[[block]]
name = "flexible"
axes = ["pitch"]
[block.plant]  # 40 / (s (0.05 s + 1)) and (s² + 2.4 s + 3600) / 3600 · 6400 / (s² + 3.2 s + 6400)
domain = "s"
num = [71.1111, 170.6667, 256000.0]
den = [0.05, 1.16, 323.2, 6400.0, 0.0]
[block.controller]
domain = "s"
method = "tustin"
num = [0.3, 0.3]
den = [1.0, 0.0]
""",
    "heavy: a pole at 0.2 rad/s": """
[auto]
disturbance_dryden = { wind_m_s = 8.0, length_m = 10.0 }
disturbance_rms = 0.1
noise_rms = 1e-3
least_disk_margin = 0.5
largest_noise_in_correction = 5e-3
attitude_gain = 3.0
[[block]]
name = "heavy"
axes = ["roll"]
[block.plant]
domain = "s"
num = [8.0]
den = [0.1, 1.02, 0.2]
[block.controller]
domain = "s"
method = "tustin"
num = [0.8, 0.8]
den = [1.0, 0.0]
""",
    "slow zero: at +12 rad/s": """
[auto]
disturbance_corner_hz = 0.5
disturbance_rms = 0.05
noise_rms = 1e-3
least_disk_margin = 0.4
largest_noise_in_correction = 5e-3
attitude_gain = 1.5
[[block]]
name = "slow zero"
axes = ["pitch"]
[block.plant]
domain = "s"
num = [-1.666667, 20.0]
den = [0.05, 1.05, 1.0]
[block.controller]
domain = "s"
method = "tustin"
num = [0.2, 0.2]
den = [1.0, 0.0]
""",
    "late: three samples of its own": """
[auto]
disturbance_corner_hz = 1.0
disturbance_rms = 0.0537
noise_rms = 4e-4
least_disk_margin = 0.35
largest_noise_in_correction = 5e-4
[[block]]
name = "late"
axes = ["pitch"]
[block.plant]
zeros = [-1.716]
poles = [1.0, 0.9447, 0.0, 0.0, 0.0]
gain = 0.14131
[block.controller]
zeros = [0.8343, 0.9987]
poles = [0.0, 1.0]
gain = 0.45
""",
}


@dataclass(frozen=True, slots=True)
class Case:
    """One axis, `asked` in its block's `auto`."""

    name: str
    block: BlockSpec
    dt: float

    @property
    def asked(self) -> AutoSpec:
        """Weather and limits."""
        assert self.block.auto is not None
        return self.block.auto


def cases() -> Iterator[Case]:
    """All of them: the tail-sitter's axes at every link delay, then the others."""
    spec = parse_spec((EXAMPLES / "tailsitter_auto.toml").read_text("utf-8"))
    blocks = {block.name: block for block in spec.blocks}
    for (name, delay), (margin, noise, late) in LIMITS.items():
        asked = AutoSpec(
            low_hz=0.1 * DISTURBANCE_HZ,
            high_hz=3.0 * DISTURBANCE_HZ,
            corner_hz=DISTURBANCE_HZ,
            spectrum=LowPass(DISTURBANCE_HZ),
            disturbance_rms=RMS[name],
            noise_rms=NOISE_SIGMA,
            least_disk_margin=margin,
            largest_noise=noise,
            least_delay_margin=late,
        )
        block = replace(blocks[name], delay_samples=delay, disturbance=None, noise=None, auto=asked)
        yield Case(f"{name}, {delay}", block, spec.dt)
    for example, axis in FLOWN:
        flown = parse_spec((EXAMPLES / f"{example}.toml").read_text("utf-8"))
        (block,) = (block for block in flown.blocks if block.name == axis)
        yield Case(f"{example}.toml, {axis}", block, flown.dt)
    for name, text in OTHERS.items():
        other = parse_spec(HEAD + text)
        yield Case(name, other.blocks[0], other.dt)
