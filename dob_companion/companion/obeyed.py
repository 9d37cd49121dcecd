"""Which vehicle is obeyed, what it is flown by, and when it was heard."""

from dob_companion.mavlink import Heartbeat, profiles
from dob_companion.mavlink.profiles import Profile
from dob_companion.supervisor import ages

SILENCE_S = 0.5
"""Wall time without a gyro message after which it is silence. Above the 0.2 s at which a waiting vehicle in lockstep
repeats its newest pair, with room for a busy machine; the vehicle itself fades a held correction within 0.2 s, so that
nothing but zeros may follow."""

SIMULATED_SILENCE_S = 5.0
"""The same for a simulation, whose clock stands while it waits: as long as it waits for an answer itself. How busy the
computer is that simulates must not change the flight."""


class Obeyed:
    """The vehicle is the configured system, or else the first that is heard, until it has been silent for long.

    `wanted` is the configured system id, None for the first that is heard; `asked` the name of the profile asked for;
    wall times in s.

    system        id of the vehicle that is obeyed; None while none has been heard
    profile       what it is flown by; the one at first while none has been heard
    gyro_at       when its last gyro sample came; when it was met, before the first
    """

    def __init__(self, wanted: int | None, asked: str, now: float) -> None:
        self.system: int | None = None
        self.profile: Profile = profiles.at_first(asked)
        self.gyro_at = now
        self._beat_at = now
        self._patience_s = SILENCE_S
        self._wanted, self._asked = wanted, asked
        self._refused: set[int] = set()

    def silent(self, now: float) -> bool:
        """No gyro sample has come for so long that nothing is known of the vehicle's motion."""
        return now - self.gyro_at >= SILENCE_S

    @property
    def silence_at(self) -> float:
        """When a correction ends for want of samples."""
        return self.gyro_at + self._patience_s

    def heard_s(self, now: float) -> float | None:
        """Time since the vehicle was last heard; None before it ever was."""
        return None if self.system is None else max(self._unheard_s(now), 0.0)

    def beat(self, now: float, *, simulated: bool) -> None:
        """Its heartbeat has come; `simulated`: its actuators are blocked, and its clock need not be the wall's."""
        self._beat_at = now
        self._patience_s = SIMULATED_SILENCE_S if simulated else SILENCE_S

    def may_become(self, system: int, now: float, *, injecting: bool) -> bool:
        """Whether this system may be obeyed from now on."""
        if self._wanted is not None:
            return system == self._wanted
        return self.system is None or (self._unheard_s(now) >= ages.VEHICLE_S and not injecting)

    def profile_for(self, beat: Heartbeat) -> Profile | None:
        """What an autopilot is flown by; None for one that the profile asked for is not for."""
        return profiles.choose(self._asked, beat.make)

    def refuse(self, beat: Heartbeat) -> str:
        """Why an autopilot is not obeyed that the profile asked for is not for, in words; "" when it was said."""
        if beat.system in self._refused:
            return ""
        self._refused.add(beat.system)
        makes = " or ".join(self.profile.makes)
        return f"system {beat.system} is {beat.make}, profile {self.profile.name} is for {makes}: not obeyed"

    def _unheard_s(self, now: float) -> float:
        return now - max(self._beat_at, self.gyro_at)
