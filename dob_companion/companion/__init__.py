"""The daemon as one pure object: bytes and time come in, bytes go out."""

from dob_companion.companion.config import CompanionConfig, Recording, parse_config
from dob_companion.companion.core import Companion
from dob_companion.companion.parameters import PARAMETERS, Parameters
from dob_companion.companion.status import Event, Status

__all__ = ["PARAMETERS", "Companion", "CompanionConfig", "Event", "Parameters", "Recording", "Status", "parse_config"]
