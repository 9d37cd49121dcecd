"""What a recording says to every reader at each of its checkpoints, whatever the program's state is made of.

A snapshot names the program's own attributes and is for the same version only. This is the part of it that readers may
rely on (docs/recording.md).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from dob_companion.companion import PARAMETERS, Companion
from dob_companion.errors import InputError
from dob_companion.mavlink import profiles
from dob_companion.supervisor import State

_PROFILES = tuple(profile.name for profile in profiles.PROFILES)


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """Where a companion stands.

    system       system id of the vehicle that is obeyed; None while none has been heard
    profile      name of the profile that it is flown by
    state        of the supervisor
    parameters   value of each parameter that can be set, by name
    """

    system: int | None
    profile: str
    state: State
    parameters: Mapping[str, float]

    @classmethod
    def of(cls, companion: Companion) -> "Standing":
        """Where this companion stands now."""
        return cls(
            system=companion.vehicle,
            profile=companion.profile.name,
            state=companion.loop.state,
            parameters={spec.name: companion.parameters[spec.name] for spec in PARAMETERS if not spec.read_only},
        )

    def as_json(self) -> dict[str, Any]:
        """As it stands in a recording."""
        parameters = dict(self.parameters)
        return {"system": self.system, "profile": self.profile, "state": self.state.name, "parameters": parameters}

    @classmethod
    def read(cls, content: Mapping[str, Any]) -> "Standing":
        """From a recording. Raises InputError, one line, that names the field and what was expected."""
        return cls(
            system=_field(content, "system", "a system id or null", _is_system),
            profile=_field(content, "profile", " or ".join(_PROFILES), lambda v: v in _PROFILES),
            state=state_named(content),
            parameters=_field(content, "parameters", "a number for each name", _are_parameters),
        )


def state_named(content: Mapping[str, Any]) -> State:
    """The state in a recording's object. Raises InputError, one line."""
    return State[_field(content, "state", " or ".join(State.__members__), _is_state)]


def reason_given(content: Mapping[str, Any]) -> str:
    """The reason in a recording's object. Raises InputError, one line."""
    return str(_field(content, "reason", "a text", lambda v: isinstance(v, str)))


def _field(content: Mapping[str, Any], name: str, expected: str, fits: Callable[[Any], bool]) -> Any:
    if name not in content:
        raise InputError(f"the recording does not say {name}, expected {expected}")
    value = content[name]
    if isinstance(value, bool) or not fits(value):
        raise InputError(f"{name} is {value!r} in the recording, expected {expected}")
    return value


def _is_state(value: Any) -> bool:
    return isinstance(value, str) and value in State.__members__


def _is_system(value: Any) -> bool:
    return value is None or (isinstance(value, int) and 0 < value < 256)


def _are_parameters(value: Any) -> bool:
    return isinstance(value, dict) and all(type(number) in (int, float) for number in value.values())
