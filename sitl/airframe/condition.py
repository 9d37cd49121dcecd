"""What has become of the aircraft: loads, faults and constraints that a scenario's events change in flight."""

from dataclasses import dataclass

from sitl.attitude import Vector


@dataclass(slots=True, kw_only=True)
class Condition:
    """Mutable; the airframe reads it every sample.

    `rotor_effectiveness` is the share of thrust and torque left, rotor by rotor. `payload_kg` hangs rigidly below the
    centre of mass. `battery_charge` is 1 when full; the voltage sags with load when `battery_sag` is set. `gain`
    multiplies the torque that each hover axis makes. `flexible` turns the flexible modes on. `held_axis` is the one
    hover axis (0 roll, 1 pitch, 2 yaw) that a vehicle held on a rod can turn about; None flies free.
    """

    rotor_effectiveness: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    payload_kg: float = 0.0
    battery_charge: float = 1.0
    battery_sag: bool = False
    gain: Vector = (1.0, 1.0, 1.0)
    flexible: bool = False
    held_axis: int | None = None
