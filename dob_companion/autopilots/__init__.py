"""What an autopilot's parameters say about its rate loop, and the design spec that follows. Pure.

Each make is a file here; docs/spec-from-parameters.md says where in its sources the formulas stand.
"""

from dob_companion.autopilots.ardupilot import ardupilot, prefix_for
from dob_companion.autopilots.autopilot import Autopilot, RateLoop
from dob_companion.autopilots.contract import CONTRACT
from dob_companion.autopilots.parameters import Parameters, parse_parameters, single
from dob_companion.autopilots.px4 import PX4
from dob_companion.autopilots.spec import Aircraft, Sourced, spec_text
from dob_companion.errors import InputError
from dob_companion.mavlink import makes

__all__ = [
    "Aircraft",
    "Autopilot",
    "Parameters",
    "RateLoop",
    "Sourced",
    "autopilot_of",
    "parse_parameters",
    "recognized",
    "single",
    "spec_text",
]

_KINDS = (ardupilot("ATC_"), ardupilot("Q_A_"), PX4, CONTRACT)


def autopilot_of(make: str, vehicle: str) -> Autopilot | None:
    """What is known of an autopilot of this make ("ArduPilot", "PX4", "generic") in this kind of vehicle, by the words
    of its heartbeat; None for any other make."""
    if make == makes.ARDUPILOT:
        return ardupilot(prefix_for(vehicle))
    return {makes.PX4: PX4, makes.GENERIC: CONTRACT}.get(make)


def recognized(parameters: Parameters) -> Autopilot:
    """Whose parameters these are. Raises InputError where no rate controller is among them."""
    for kind in _KINDS:
        if kind.telltale in parameters.values:
            return kind
    names = ", ".join(f"{kind.telltale} ({kind.name})" for kind in _KINDS)
    raise InputError(f"{parameters.source}: no rate controller's parameters; expected one of {names}")
