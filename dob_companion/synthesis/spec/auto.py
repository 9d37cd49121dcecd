"""The `[auto]` table of a spec: what a pilot knows, in place of weights. Pure; `tune/tuning.py` makes weights of it."""

import math
from dataclasses import dataclass

from dob_companion.errors import SpecError
from dob_companion.synthesis.spec.limits import LONGEST_DELAY
from dob_companion.toml import Table, shown

KEYS = (
    "disturbance_band_hz",
    "disturbance_corner_hz",
    "noise_density",
    "noise_rms",
    "least_disk_margin",
    "least_delay_margin_samples",
    "largest_noise_in_correction",
    "largest_slowest_mode_s",
    "attitude_gain",
)

DELAY_MARGIN_SAMPLES = 2
"""Default of `least_delay_margin_samples`: `run` injects on a link one sample slower than designed for, whose slowest
twentieth may be another one late."""

BAND_OF_CORNER = 0.1, 3.0
"""What is searched around a low-pass: from a tenth of its corner to three times, where its power lives."""

NOISE_IN_CORRECTION = 0.01
"""Default of `largest_noise_in_correction`: gyro noise may use up a hundredth of the torque, in RMS."""

SLOWEST_MODE_S = 0.5
"""Default of `largest_slowest_mode_s`: what the observer began with is forgotten while the correction fades in."""

ATTITUDE_GAIN = 6.5
"""Default of `attitude_gain`, 1/s: that of PX4's MC_ROLL_P and MC_PITCH_P and of the simulated vehicle."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AutoSpec:
    """What is asked of a tuning.

    low_hz, high_hz   the band in which disturbances live
    corner_hz         None: their spectrum is flat over the band. Else that of white noise through a first-order
                      low-pass of this corner, whose band is BAND_OF_CORNER of it
    noise_rms         standard deviation of the gyro noise at the design's rate, rad/s, white
    least_disk_margin, least_delay_margin   of each block, all its axes at once (docs/interfaces.md); the latter in
                      further whole samples of delay that the vehicle does not report
    largest_noise     RMS of the correction that gyro noise alone causes, normalized torque, the worst axis
    largest_mode_s    time constant of the observer's slowest mode, s
    attitude_gain     rate asked for per attitude error by the loop around the rate loop, 1/s; 0 for none
    """

    low_hz: float
    high_hz: float
    noise_rms: float
    least_disk_margin: float
    largest_noise: float = NOISE_IN_CORRECTION
    largest_mode_s: float = SLOWEST_MODE_S
    attitude_gain: float = ATTITUDE_GAIN
    least_delay_margin: int = DELAY_MARGIN_SAMPLES
    corner_hz: float | None = None

    @property
    def disturbances(self) -> str:
        """Their spectrum in words."""
        if self.corner_hz is None:
            return f"disturbances of {self.low_hz:g} to {self.high_hz:g} Hz"
        return f"disturbances through a {self.corner_hz:g} Hz low-pass"


def parse_auto(table: Table, rate_hz: float) -> AutoSpec:
    """Read the table. Raises SpecError, one line that names the place and the key."""
    table.expect(KEYS)
    low, high, corner = _spectrum(table, rate_hz)
    return AutoSpec(
        low_hz=low,
        high_hz=high,
        noise_rms=_noise(table, rate_hz),
        least_disk_margin=table.number("least_disk_margin", lambda x: 0.0 < x < 2.0, "a number between 0 and 2"),
        largest_noise=_positive(table, "largest_noise_in_correction", NOISE_IN_CORRECTION),
        largest_mode_s=_positive(table, "largest_slowest_mode_s", SLOWEST_MODE_S),
        attitude_gain=table.number("attitude_gain", lambda x: x >= 0.0, "a number of 0 or more", ATTITUDE_GAIN),
        least_delay_margin=table.whole("least_delay_margin_samples", DELAY_MARGIN_SAMPLES, LONGEST_DELAY),
        corner_hz=corner,
    )


def _spectrum(table: Table, rate_hz: float) -> tuple[float, float, float | None]:
    """Band, and corner of the low-pass if it is one."""
    if ("disturbance_band_hz" in table) == ("disturbance_corner_hz" in table):
        raise SpecError(f"{table.where}: expected disturbance_band_hz or disturbance_corner_hz, one of them")
    if "disturbance_band_hz" in table:
        return *_band(table, rate_hz), None
    low, high = BAND_OF_CORNER
    most = rate_hz / 2.0 / high
    corner = table.number("disturbance_corner_hz", lambda x: 0.0 < x < most, f"a number between 0 and {most:g} Hz")
    return low * corner, high * corner, corner


def _band(table: Table, rate_hz: float) -> tuple[float, float]:
    band = table.numbers("disturbance_band_hz")
    if len(band) != 2 or not 0.0 < band[0] < band[1] < rate_hz / 2.0:
        raise SpecError(
            f"{table.where}: disturbance_band_hz: expected [low, high] with 0 < low < high < {rate_hz / 2.0:g} Hz "
            f"(half the rate), got {shown(list(band))}"
        )
    return band[0], band[1]


def _noise(table: Table, rate_hz: float) -> float:
    """Sigma of white noise at the rate; a one-sided density fills the band up to half the rate."""
    if ("noise_rms" in table) == ("noise_density" in table):
        raise SpecError(f"{table.where}: expected noise_density (rad/s/√Hz) or noise_rms (rad/s), one of them")
    if "noise_rms" in table:
        return _positive(table, "noise_rms")
    return _positive(table, "noise_density") * math.sqrt(rate_hz / 2.0)


def _positive(table: Table, key: str, default: float | None = None) -> float:
    return table.number(key, lambda x: x > 0.0, "a positive number", default)
