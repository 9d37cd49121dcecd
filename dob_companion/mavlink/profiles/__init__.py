"""The profiles by name, and which one an autopilot is flown with. A new one is a file beside these and a line here."""

from dob_companion.mavlink.profiles.ardupilot import ARDUPILOT
from dob_companion.mavlink.profiles.profile import AgeSource, LandedRule, Profile, Reader, Stream
from dob_companion.mavlink.profiles.px4 import PX4
from dob_companion.mavlink.profiles.sitl import SITL

AUTO = "auto"
"""Asks for the profile that is recognized by the make of the autopilot."""

FALLBACK = SITL
"""For an autopilot that no profile is recognized by, and before one is heard."""

PROFILES = (SITL, ARDUPILOT, PX4)
NAMES = (AUTO, *(profile.name for profile in PROFILES))
"""What may be asked for."""


def named(name: str) -> Profile:
    """The profile of this name. Raises KeyError where there is none."""
    return _BY_NAME[name]


def at_first(asked: str) -> Profile:
    """What holds for one of `NAMES` before an autopilot is heard. Raises KeyError for another name."""
    return FALLBACK if asked == AUTO else named(asked)


def choose(asked: str, make: str) -> Profile | None:
    """The profile for an autopilot of this make; None when the one asked for is not for it."""
    if asked != AUTO:
        return named(asked) if named(asked).suits(make) else None
    return next((profile for profile in PROFILES if make in profile.makes), FALLBACK)


def rate_hz(asked: str) -> float:
    """The rate that a design must be for. It is checked before the autopilot is known, so all have FALLBACK's."""
    return at_first(asked).rate_hz


_BY_NAME = {profile.name: profile for profile in PROFILES}

__all__ = [
    "AUTO",
    "FALLBACK",
    "NAMES",
    "PROFILES",
    "AgeSource",
    "LandedRule",
    "Profile",
    "Reader",
    "Stream",
    "at_first",
    "choose",
    "named",
    "rate_hz",
]
