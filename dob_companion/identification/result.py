"""What an identification found: responses with their bands, models with their intervals, and whether they are usable.

The plant is what the link shows: from the normalized torque that acts (held from one sample to the next) to the
streamed rate, gyro filter included where the autopilot streams the filtered rate.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dob_companion.autopilots.transfer import NOTHING, Transfer
from dob_companion.identification.held import held_response

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Interval:
    """A number and its 95 % interval; low = high = value where it is known exactly. Not always in the middle."""

    value: float
    low: float
    high: float

    def to_object(self) -> dict[str, float]:
        """value, low and high, plain numbers."""
        return {"value": self.value, "low": self.low, "high": self.high}


@dataclass(frozen=True, slots=True)
class Segment:
    """A stretch of the record, s on its clock. `why` says why it was left out; "" where it was used, for `axes`."""

    begin: float
    end: float
    why: str = ""
    axes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Response:
    """A frequency response over n frequencies, estimated in closed loop, as the record shows it.

    frequency     rad/s, rising, shape (n,)
    value         rate per normalized torque, rad/s, the torque held between samples of `rate_hz`
    deviation     standard deviation of the complex value, sqrt(E |error|²)
    band          radius of the disk around the value that holds the true one at 95 %, each frequency by itself
    coherence_u   squared coherence of instrument and torque
    coherence_y   squared coherence of instrument and rate
    averages      independent averages behind each value
    direct        S_yu / S_uu, which wind and noise draw towards -1/C: for comparison only
    inverse_controller   -1/C of the autopilot's rate and attitude loop by its parameters; None where not known
    loop          C G that closes around what was injected, attitude loop included; None for other instruments
    instrument    "injected signal", "attitude setpoint" or "rate setpoint"
    axes          those that were estimated together, this one first
    """

    frequency: Floats
    value: Complexes
    deviation: Floats
    band: Floats
    coherence_u: Floats
    coherence_y: Floats
    averages: Floats
    direct: Complexes
    rate_hz: float
    instrument: str
    axes: tuple[str, ...]
    inverse_controller: Complexes | None = None
    loop: Complexes | None = None


@dataclass(frozen=True, slots=True)
class Mode:
    """A flexible mode: (1 + 2 zeta_z s/w_z + s²/w_z²) / (1 + 2 zeta s/w + s²/w²), a dip and a peak."""

    frequency_hz: Interval
    damping: Interval
    zero_frequency_hz: Interval
    zero_damping: Interval

    def transfer(self) -> Transfer:
        """At the values, without their intervals."""
        peak, dip = 2.0 * np.pi * self.frequency_hz.value, 2.0 * np.pi * self.zero_frequency_hz.value
        return Transfer(
            (1.0 / dip**2, 2.0 * self.zero_damping.value / dip, 1.0),
            (1.0 / peak**2, 2.0 * self.damping.value / peak, 1.0),
        )


@dataclass(frozen=True, slots=True)
class Bound:
    """|G_true / G - 1| at most, jointly at 95 %: rising frequencies in Hz; linear in between, constant beyond.

    Everything is in it: what is not known of the parameters, what the form of the model leaves, and what was not
    measured. `band_hz` is where it was measured. These are the keys of `[block.uncertainty]`.
    """

    frequency_hz: tuple[float, ...]
    multiplicative: tuple[float, ...]
    band_hz: tuple[float, float]

    def at(self, hz: Floats) -> Floats:
        """The bound at these frequencies, Hz."""
        return np.interp(hz, self.frequency_hz, self.multiplicative)

    def to_object(self) -> dict[str, list[float]]:
        """As `[block.uncertainty]` takes it."""
        return {"frequency_hz": list(self.frequency_hz), "multiplicative": list(self.multiplicative)}


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisModel:
    """K (1 + s lead) e^(-s delay) / ((s + slow_pole) (1 + s lag)), times modes, times filters: what the link shows.

    acceleration_per_unit   K, rad/s² per unit of normalized torque, above the slow pole
    slow_pole_rad_s         0 for an integrator, lag_s 0 where none was found; their intervals hold whatever was chosen
    lead_s                  of the rotors' own inertia, of either sign; 0 unless the data insist, never without a lag
    filters, about_filters  the known part, not fitted: the autopilot's gyro filter as the link shows it, and in words
    structure, why          the form that was chosen, and by what evidence
    misfit                  root mean square of |Ĝ/G - 1| over the band, each frequency weighted by its accuracy
    chi2                    mean square of the misfits over what noise explains: near 1 where the form is right
    held_out_misfit, held_out_chi2   the same for windows that were not fitted; nan where there were too few
    """

    acceleration_per_unit: Interval
    slow_pole_rad_s: Interval
    lag_s: Interval
    delay_s: Interval
    bound: Bound
    lead_s: Interval = Interval(0.0, 0.0, 0.0)
    modes: tuple[Mode, ...] = ()
    filters: Transfer = NOTHING
    about_filters: tuple[str, ...] = ()
    structure: str = ""
    why: str = ""
    misfit: float = float("nan")
    chi2: float = float("nan")
    held_out_misfit: float = float("nan")
    held_out_chi2: float = float("nan")

    def transfer(self) -> Transfer:
        """All but the delay: normalized torque to streamed rate, of s."""
        lag = self.lag_s.value
        whole = Transfer((self.acceleration_per_unit.value,), (1.0, self.slow_pole_rad_s.value))
        whole *= Transfer((1.0,), (lag, 1.0) if lag else (1.0,))
        if self.lead_s.value:
            whole *= Transfer((self.lead_s.value, 1.0), (1.0,))
        for mode in self.modes:
            whole *= mode.transfer()
        return whole * self.filters

    def response(self, frequency: Floats, rate_hz: float) -> Complexes:
        """Behind a hold at `rate_hz`, sampled with it, delay included; frequency in rad/s."""
        whole = self.transfer()
        return held_response(whole.num, whole.den, self.delay_s.value, 1.0 / rate_hz, frequency)

    def uncertainty(self) -> dict[str, list[float]]:
        """The keys of `[block.uncertainty.AXIS]`, for this model as nominal plant; nothing is to be added to them."""
        return self.bound.to_object()


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisResult:
    """One axis. `why` is one line in any case: what speaks for the model, or why it cannot be used and what to fly.

    response   None where there was nothing to estimate from
    model      None where nothing could be fitted; may be there without being usable
    mistaken   whether signals are not what they are named for, so that those of other axes may not be either
    """

    axis: str
    usable: bool
    why: str
    response: Response | None = None
    model: AxisModel | None = None
    mistaken: bool = False

    def to_object(self) -> dict[str, object]:
        """As `identify --json` prints it: intervals are {value, low, high}, or null where there is no model."""
        model = self.model
        return {
            "acceleration_per_unit": model.acceleration_per_unit.to_object() if model else None,
            "slow_pole_rad_s": model.slow_pole_rad_s.to_object() if model else None,
            "lag_s": model.lag_s.to_object() if model else None,
            "lead_s": model.lead_s.to_object() if model else None,
            "delay_s": model.delay_s.to_object() if model else None,
            "usable": self.usable,
            "why": self.why,
            "gyro_filter": "; ".join(model.about_filters) if model else "",
            "modes": [
                {"frequency_hz": mode.frequency_hz.to_object(), "damping": mode.damping.to_object()}
                for mode in (model.modes if model else ())
            ],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Identification:
    """All axes of a record.

    axes        by name, in the order asked for
    rate_hz     the design's, as asked for; models are continuous, the remarks say on which grid they were found
    source      of the record
    segments    what of the record was used, and what not and why, in order of time
    remarks     one line each, those of the record's reader first
    parameters  of the autopilot, by its own names
    """

    axes: Mapping[str, AxisResult]
    rate_hz: float
    source: str
    segments: tuple[Segment, ...]
    remarks: tuple[str, ...]
    parameters: Mapping[str, float]

    @property
    def usable(self) -> tuple[str, ...]:
        """The axes that a design may be made for."""
        return tuple(axis for axis, result in self.axes.items() if result.usable)

    def to_object(self) -> dict[str, object]:
        """As `identify --json` prints it."""
        return {"axes": {axis: result.to_object() for axis, result in self.axes.items()}}
