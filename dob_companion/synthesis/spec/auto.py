"""The `[auto]` table of a spec: what a pilot knows, in place of weights. Pure; `tune/tuning.py` makes weights of it."""

import math
from dataclasses import dataclass
from itertools import pairwise

from dob_companion.errors import SpecError
from dob_companion.synthesis.spec.limits import LONGEST_DELAY
from dob_companion.synthesis.spec.spectrum import Band, Dryden, LowPass, Measured, Shape
from dob_companion.toml import Table, shown

SPECTRA = ("disturbance_corner_hz", "disturbance_band_hz", "disturbance_dryden", "disturbance_spectrum")
"""Ways to state where the disturbances live; a table states one of them."""

ALTERNATIVES = (SPECTRA, ("noise_density", "noise_rms"))
"""Keys that stand for one another."""

KEYS = (
    *SPECTRA,
    "disturbance_rms",
    "noise_density",
    "noise_rms",
    "least_disk_margin",
    "least_delay_margin_samples",
    "largest_noise_in_correction",
    "largest_noise_gain",
    "largest_slowest_mode_s",
    "moment_rate_hz",
    "attitude_gain",
    "gains",
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

GAINS = (0.7, 1.3)
"""Default of `gains`: a hover's rotor thrust, battery and mass move the plant's gain by as much."""

MOST_GAINS = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class AutoSpec:
    """What is asked of a tuning.

    low_hz, high_hz   the band in which disturbances live; of a low-pass and of gusts BAND_OF_CORNER of their corner
    corner_hz         of the low-pass that white noise passes to become them; None where that is not how they are stated
    spectrum          their spectrum, up to a factor
    disturbance_rms   normalized torque; None: their size plays no part, and gyro noise does not count in the attitude
    noise_rms         standard deviation of the gyro noise at the design's rate, rad/s, white
    least_disk_margin, least_delay_margin   of each block, all its axes at once (docs/interfaces.md); the latter in
                      further whole samples of delay that the vehicle does not report
    largest_noise     RMS of the correction that gyro noise alone causes, normalized torque, the worst axis
    largest_mode_s    time constant of the observer's slowest mode, s
    largest_peak      gain of n -> d_hat at any frequency, normalized torque per rad/s; None for any
    moment_rate_hz    how often the applied moment is read beside the controller; None where that of each sample is told
    attitude_gain     rate asked for per attitude error by the loop around the rate loop, 1/s; 0 for none
    gains             of the plant, beside 1, over which the attitude error is made small as well
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
    spectrum: Shape
    disturbance_rms: float | None = None
    largest_peak: float | None = None
    moment_rate_hz: float | None = None
    gains: tuple[float, ...] = GAINS

    @property
    def disturbances(self) -> str:
        """Their spectrum in words."""
        return f"disturbances {self.spectrum.words}"


def parse_auto(table: Table, rate_hz: float) -> AutoSpec:
    """Read the table. Raises SpecError, one line that names the place and the key."""
    table.expect(KEYS)
    shape, low, high = _spectrum(table, rate_hz)
    return AutoSpec(
        low_hz=low,
        high_hz=high,
        noise_rms=_noise(table, rate_hz),
        least_disk_margin=table.number("least_disk_margin", lambda x: 0.0 < x < 2.0, "a number between 0 and 2"),
        largest_noise=_positive(table, "largest_noise_in_correction", NOISE_IN_CORRECTION),
        largest_mode_s=_positive(table, "largest_slowest_mode_s", SLOWEST_MODE_S),
        attitude_gain=table.number("attitude_gain", lambda x: x >= 0.0, "a number of 0 or more", ATTITUDE_GAIN),
        least_delay_margin=table.whole("least_delay_margin_samples", DELAY_MARGIN_SAMPLES, LONGEST_DELAY),
        corner_hz=shape.corner_hz if isinstance(shape, LowPass) else None,
        spectrum=shape,
        disturbance_rms=_positive(table, "disturbance_rms") if "disturbance_rms" in table else None,
        largest_peak=_positive(table, "largest_noise_gain") if "largest_noise_gain" in table else None,
        moment_rate_hz=_positive(table, "moment_rate_hz") if "moment_rate_hz" in table else None,
        gains=_gains(table),
    )


def overridden(common: Table, own: Table) -> Table:
    """What [auto] says for all blocks, with a block's own keys in the place of those that say the same."""
    replaced = {key for keys in ALTERNATIVES if any(key in own for key in keys) for key in keys}
    return common.without(replaced).with_own(own)


def _spectrum(table: Table, rate_hz: float) -> tuple[Shape, float, float]:
    """The spectrum and the band around it."""
    stated = [key for key in SPECTRA if key in table]
    if len(stated) != 1:
        raise SpecError(f"{table.where}: expected one of {', '.join(SPECTRA)}, got {shown(stated)}")
    if stated == ["disturbance_band_hz"]:
        low, high = _band(table, rate_hz)
        return Band(low, high), low, high
    if stated == ["disturbance_spectrum"]:
        return _measured(table.table("disturbance_spectrum", ("hz", "power")), rate_hz)
    low, high = BAND_OF_CORNER
    most = rate_hz / 2.0 / high
    if stated == ["disturbance_dryden"]:
        inner = table.table("disturbance_dryden", ("wind_m_s", "length_m"))
        gusts = Dryden(_positive(inner, "wind_m_s"), _positive(inner, "length_m"))
        if not gusts.corner_hz < most:
            raise SpecError(f"{inner.where}: a corner of {gusts.corner_hz:.3g} Hz, expected one below {most:g} Hz")
        return gusts, low * gusts.corner_hz, high * gusts.corner_hz
    corner = table.number("disturbance_corner_hz", lambda x: 0.0 < x < most, f"a number between 0 and {most:g} Hz")
    return LowPass(corner), low * corner, high * corner


def _measured(table: Table, rate_hz: float) -> tuple[Shape, float, float]:
    hz, power = table.numbers("hz"), table.numbers("power")
    rising = all(a < b for a, b in pairwise(hz))
    if len(hz) < 2 or not rising or not 0.0 < hz[0] < hz[-1] < rate_hz / 2.0:
        raise SpecError(
            f"{table.where}: hz: expected two or more rising frequencies between 0 and {rate_hz / 2.0:g} Hz "
            f"(half the rate), got {shown(list(hz))}"
        )
    if len(power) != len(hz) or not all(x > 0.0 for x in power):
        raise SpecError(f"{table.where}: power: expected {len(hz)} positive numbers, one for each of hz")
    return Measured(hz, power), hz[0], hz[-1]


def _gains(table: Table) -> tuple[float, ...]:
    """Of the plant, beside 1."""
    if "gains" not in table:
        return GAINS
    gains = table.numbers("gains")
    if len(gains) > MOST_GAINS or not all(0.0 < gain <= 10.0 for gain in gains):
        raise SpecError(
            f"{table.where}: gains: expected at most {MOST_GAINS} factors of the plant's gain, above 0 and up to 10, "
            f"got {shown(list(gains))}"
        )
    return tuple(gain for gain in gains if gain != 1.0)


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
