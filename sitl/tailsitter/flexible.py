"""Three flexible modes between the rotors' torque and the gyro.

Mode i: q̈ + 2ζΩ q̇ + Ω² q = Σ φᵢⱼ αⱼ, where αⱼ is the angular acceleration that the torque about axis j would give the
rigid body; the gyro turns by φᵢⱼ q̇ about axis j more than the body does. Force and sensor share the shape φ, as at one
place of the structure, so each mode is passive.

Limits: shapes, frequencies and damping are guesses; flexing does not act back on the rigid motion.
"""

from typing import Any

from sitl.tailsitter.compiled import compiled
from sitl.tailsitter.layout import INERTIA, MODE, MODE_RATE, PICKUP, TORQUE_SUM


@compiled
def flex(x: Any, dx: Any, out: Any, sums: Any, p: Any) -> None:
    """Rates of change of the modes under the torque in `sums`, and the gyro's pickup into `out`, which was zero."""
    roll = sums[TORQUE_SUM] / sums[INERTIA]
    pitch = sums[TORQUE_SUM + 1] / sums[INERTIA + 1]
    yaw = sums[TORQUE_SUM + 2] / sums[INERTIA + 2]
    for i in range(3):
        a, b, c, w = p["mode_roll"][i], p["mode_pitch"][i], p["mode_yaw"][i], p["mode_frequency"][i]
        rate = x[MODE_RATE + i]
        dx[MODE + i] = rate
        push = a * roll + b * pitch + c * yaw
        dx[MODE_RATE + i] = push - 2.0 * p["mode_damping"] * w * rate - w * w * x[MODE + i]
        out[PICKUP] += a * rate
        out[PICKUP + 1] += b * rate
        out[PICKUP + 2] += c * rate
