"""What [auto] asks, as the programmes take it."""

from dob_companion.synthesis.optimal.problem import Spectrum, Wanted
from dob_companion.synthesis.spec.auto import AutoSpec


def spectrum_of(auto: AutoSpec) -> Spectrum:
    """The disturbance of [auto]; without an attitude loop noise would add up in the attitude without end."""
    return Spectrum(auto.spectrum, auto.disturbance_rms if auto.attitude_gain else None)


def wanted_of(auto: AutoSpec, slack: float) -> Wanted:
    """The limits of [auto], each but the delay margin kept clear of by the factor `slack`."""
    return Wanted(
        disk_margin=auto.least_disk_margin * slack,
        noise=auto.largest_noise / slack,
        noise_rms=auto.noise_rms,
        peak=None if auto.largest_peak is None else auto.largest_peak / slack,
        delay_margin=auto.least_delay_margin,
        slowest_s=auto.largest_mode_s / slack,
        moment_hz=auto.moment_rate_hz,
        gains=auto.gains,
    )
