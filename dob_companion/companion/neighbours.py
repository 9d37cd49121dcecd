"""Whose corrections are heard on the link: our own coming back, or somebody else's.

A link may send back what we said, at once, much later or twice, and some autopilots send a correction on under their
own name. A second companion of the same vehicle has our very ids, and answers the same samples. So a correction under
our name is judged by what it says, and ours is what we have sent, or may have sent before our record of it begins.
"""

from dob_companion.mavlink import AUTOPILOT, COMPANION, CorrectionHeard
from dob_companion.supervisor import Echo


class Neighbours:
    """Remembers under which system ids we have spoken."""

    def __init__(self) -> None:
        self._ours: set[int] = set()

    def we_are(self, system: int) -> None:
        """From now on we speak as component 191 of this system."""
        self._ours.add(system)

    def injects(self, heard: CorrectionHeard, echo: Echo) -> bool:
        """Whether another companion is at work; never for what we said ourselves."""
        if not self._ours:
            return False
        if heard.sender.system in self._ours:
            if heard.sender.component == AUTOPILOT:
                return False
            if heard.sender.component == COMPANION:
                return echo.others(heard.stamp_us, heard.correction)
        return not echo.ours(heard.stamp_us, heard.correction)
