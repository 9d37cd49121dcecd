"""Torque and thrust into four rotors and back: who gives way when a rotor has no more to give.

Order of sacrifice, the least important first: yaw, then thrust, then roll and pitch together. This is what PX4 does
with its air mode on roll and pitch (`ControlAllocationSequentialDesaturation`, MC_AIRMODE 1: thrust moves up or down
to keep roll and pitch, yaw takes what is left); ArduPilot's `AP_MotorsMatrix` ranks alike, but keeps a minimum of yaw.
Scaling roll and pitch by the same factor keeps the direction of the torque.
"""

from typing import NamedTuple

from sitl.attitude import Vector

Four = tuple[float, float, float, float]

ROLL: Four = (-1.0, 1.0, 1.0, -1.0)
PITCH: Four = (1.0, -1.0, 1.0, -1.0)
YAW: Four = (1.0, 1.0, -1.0, -1.0)
"""Signs of each rotor's thrust in the torque about an axis: front right, rear left, front left, rear right."""


class Mixer(NamedTuple):
    """`share` is the change of a rotor's command asked for by a torque of 1; commands stay between `low` and `high`."""

    share: float
    low: float
    high: float

    def allocate(self, torque: Vector, thrust: float) -> tuple[Vector, float]:
        """Torque (roll, pitch, yaw) and thrust that the rotors can give at once; normalized, as asked for."""
        share, low, high = self.share, self.low, self.high
        roll, pitch, yaw = torque
        span = 2.0 * share * (abs(roll) + abs(pitch))  # between the rotor asked for most and least
        if span > high - low:
            k = (high - low) / span
            roll, pitch, span = k * roll, k * pitch, high - low
        half = 0.5 * span
        thrust = min(max(thrust, low + half), high - half)
        return (roll, pitch, self._yaw(share * roll, share * pitch, yaw, thrust)), thrust

    def _yaw(self, roll: float, pitch: float, yaw: float, thrust: float) -> float:
        """As much of `yaw` as leaves every rotor within its limits."""
        up = self.high - thrust
        down = thrust - self.low
        # Rotors 0, 1 gain with yaw and carry ∓(roll − pitch); 2, 3 lose and carry ±(roll + pitch).
        a, b = abs(roll - pitch), abs(roll + pitch)
        most = (min(up - a, down - b) if yaw > 0.0 else min(up - b, down - a)) / self.share
        most = max(0.0, most)
        return max(-most, min(most, yaw))

    def commands(self, torque: Vector, thrust: float) -> Four:
        """Commands of the four rotors, share of full thrust; within the limits for what `allocate` returns."""
        roll, pitch, yaw = self.share * torque[0], self.share * torque[1], self.share * torque[2]
        return (
            thrust - roll + pitch + yaw,
            thrust + roll - pitch + yaw,
            thrust + roll + pitch - yaw,
            thrust - roll - pitch - yaw,
        )
