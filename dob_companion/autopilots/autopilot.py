"""What is to be known of an autopilot's rate loop, as one frozen object."""

from collections.abc import Callable
from dataclasses import dataclass

from dob_companion.autopilots.parameters import Parameters
from dob_companion.autopilots.transfer import NOTHING, Transfer


@dataclass(frozen=True, slots=True, kw_only=True)
class RateLoop:
    """One axis as its parameters say. `about_…` are lines for a comment, with the parameters and their values.

    controller   C(s) of u = C (r - y), from the streamed rate in rad/s to normalized torque
    filters      between the aircraft's rate and the streamed one, 1 at low frequency
    gyro         what the rate controller sees the aircraft's rate through, in the stream or not
    late_s       how late the streamed rate is besides, s
    remarks      what these parameters do that no linear model holds
    """

    controller: Transfer
    about_controller: tuple[str, ...]
    filters: Transfer = NOTHING
    about_filters: tuple[str, ...] = ()
    gyro: Transfer = NOTHING
    about_gyro: tuple[str, ...] = ()
    late_s: float = 0.0
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Autopilot:
    """A make, and in which parameters its rate loop stands.

    telltale       a parameter that no other has
    names          all that are read, for who must ask for each
    attitude_gain  the parameter of the attitude loop in roll and pitch, 1/s
    delay_samples  least of a design for it: what its link and loop were seen to take at 250 Hz
    loop           reads one of AXES. Raises InputError that names a parameter
    moment_rate_hz how often a program beside its controller was seen to read the applied moment; None where its own
                   controller tells that of each sample
    """

    name: str
    telltale: str
    names: tuple[str, ...]
    attitude_gain: str
    delay_samples: int
    loop: Callable[[Parameters, str], RateLoop]
    moment_rate_hz: float | None = None


def nonzero(parameters: Parameters, names: tuple[str, ...], what: str) -> tuple[str, ...]:
    """A remark where one of these is set."""
    said = ", ".join(parameters.said(name) for name in names if parameters.get(name))
    return (f"{said}: {what}",) if said else ()
