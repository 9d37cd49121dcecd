"""The operator's side: a ground station on MAVSDK. Talks to the vehicle as any ground station does."""

from dob_companion.ground.station import GroundStation, Telemetry

__all__ = ["GroundStation", "Telemetry"]
