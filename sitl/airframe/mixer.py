"""Torque and thrust into four rotors: who gives way when a rotor has no more to give.

Order of sacrifice: thrust moves first, up or down, as far as it takes; then yaw shrinks; roll and pitch shrink last and
by the same factor, which keeps the direction of their torque. This is PX4's air mode on all three axes
(`ControlAllocationSequentialDesaturation::mixAirmodeRPY`, MC_AIRMODE 2). ArduPilot's `AP_MotorsMatrix` ranks roll and
pitch before yaw too, but gives yaw a minimum. A hover that must fly a torque disturbance at a third of full thrust has
little room below and much above; the altitude hold takes back what thrust gave.
"""

from typing import NamedTuple, Protocol

from sitl.attitude import Vector

Four = tuple[float, float, float, float]

ROLL: Four = (-1.0, 1.0, 1.0, -1.0)
PITCH: Four = (1.0, -1.0, 1.0, -1.0)
YAW: Four = (1.0, 1.0, -1.0, -1.0)
"""Signs of each rotor's thrust in the torque about an axis: front right, rear left, front left, rear right."""


class Allocator(Protocol):
    """What turns the torque about roll, pitch, yaw and the thrust asked for (normalized) into rotor commands."""

    def allocate(self, torque: Vector, thrust: float) -> tuple[Vector, float]:
        """What can be had of what is asked for; u_e is what comes out of it."""
        ...

    def commands(self, torque: Vector, thrust: float) -> Four:
        """Commands of the four rotors for what `allocate` returned, 0…1."""
        ...


class Mixer(NamedTuple):
    """`share` is the change of a rotor's command asked for by a torque of 1; commands stay between `low` and `high`."""

    share: float
    low: float
    high: float

    def allocate(self, torque: Vector, thrust: float) -> tuple[Vector, float]:
        """Torque (roll, pitch, yaw) and thrust that the rotors can give at once; normalized, as asked for."""
        reach = self.high - self.low
        roll, pitch, yaw = self.share * torque[0], self.share * torque[1], self.share * torque[2]
        k = 1.0
        if 2.0 * (abs(roll) + abs(pitch)) > reach:
            k = 0.5 * reach / (abs(roll) + abs(pitch))
            roll, pitch = k * roll, k * pitch
        # Two rotors carry yaw ± a, the others −yaw ± b; the widest pair of all four is a + b + 2 abs(yaw) apart.
        a, b = abs(roll - pitch), abs(roll + pitch)
        most = max(0.0, 0.5 * (reach - a - b))
        spin = yaw
        if abs(yaw) > most:
            spin = most if yaw > 0.0 else -most
        highest, lowest = max(a + spin, b - spin), min(spin - a, -spin - b)
        thrust = min(max(thrust, self.low - lowest), self.high - highest)
        return (k * torque[0], k * torque[1], torque[2] if spin == yaw else spin / self.share), thrust

    def commands(self, torque: Vector, thrust: float) -> Four:
        """Commands of the four rotors, share of full thrust; within the limits for what `allocate` returns."""
        roll, pitch, yaw = self.share * torque[0], self.share * torque[1], self.share * torque[2]
        return (
            thrust - roll + pitch + yaw,
            thrust + roll - pitch + yaw,
            thrust + roll + pitch - yaw,
            thrust - roll - pitch - yaw,
        )


_FOR_SHOW = Mixer(share=0.5, low=0.0, high=1.0)


class SeparateAxes:
    """The allocator of the linear axes: each saturates at ±1 on its own, there are no rotors to share."""

    def allocate(self, torque: Vector, thrust: float) -> tuple[Vector, float]:
        """See `Allocator.allocate`."""
        x, y, z = torque
        return (max(-1.0, min(1.0, x)), max(-1.0, min(1.0, y)), max(-1.0, min(1.0, z))), thrust

    def commands(self, torque: Vector, thrust: float) -> Four:
        """For show: nothing but u_e and thrust moves the linear axes."""
        first, second, third, fourth = (max(0.0, min(1.0, each)) for each in _FOR_SHOW.commands(torque, thrust))
        return first, second, third, fourth
