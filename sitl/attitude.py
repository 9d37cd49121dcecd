"""Unit quaternions as plain tuples (w, x, y, z), scalar first, hover axes to local north-east-down.

Hover axes: x_hover = z_b, y_hover = y_b, z_hover = −x_b of the paper's forward-flight body axes; z is down in hover,
so the identity is a tail-sitter standing on its tail, belly to the north.
"""

from math import cos, sin, sqrt

from sitl.constants import GRAVITY

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

LEVEL: Quaternion = (1.0, 0.0, 0.0, 0.0)
ZERO: Vector = (0.0, 0.0, 0.0)


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Hamilton product a ⊗ b."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def rotated_by_rate(q: Quaternion, rate: Vector, dt: float) -> Quaternion:
    """Attitude after turning for `dt` seconds at a constant body rate (rad/s): q ⊗ exp(ω dt / 2), renormalized.

    The exponential map is exact for a constant rate; normalization only removes rounding.
    """
    x, y, z = rate
    speed = sqrt(x * x + y * y + z * z)
    half = 0.5 * dt * speed
    # sin(half)/speed, with its limit dt/2 where the quotient is 0/0
    k = sin(half) / speed if half > 1e-9 else 0.5 * dt
    w, x, y, z = multiply(q, (cos(half), k * x, k * y, k * z))
    n = 1.0 / sqrt(w * w + x * x + y * y + z * z)
    return (w * n, x * n, y * n, z * n)


def turned_back(q: Quaternion, v: Vector) -> Vector:
    """A vector given in north-east-down, seen in hover axes: q⁻¹ v q."""
    w, x, y, z = q
    _, a, b, c = multiply(multiply((w, -x, -y, -z), (0.0, *v)), q)
    return (a, b, c)


def attitude_error(commanded: Quaternion, q: Quaternion) -> Vector:
    """Attitude error e = 2 · sign(q₀) · vec(q_cmd⁻¹ ⊗ q), rad for small angles, hover axes, shorter way round.

    This is the error of `result.json` and the one the quaternion attitude loop of the paper's Fig. 4 acts on.
    """
    w, x, y, z = commanded
    ew, ex, ey, ez = multiply((w, -x, -y, -z), q)
    k = 2.0 if ew >= 0.0 else -2.0
    return (k * ex, k * ey, k * ez)


def down_component(q: Quaternion) -> float:
    """Cosine of the tilt: how much of the body's z axis points down."""
    _, x, y, _ = q
    return 1.0 - 2.0 * (x * x + y * y)


def lean(north: float, east: float) -> Quaternion:
    """Shortest rotation that turns thrust from straight up to one with this horizontal acceleration, m/s²."""
    size = sqrt(north * north + east * east + GRAVITY * GRAVITY)
    x, y, z = -north / size, -east / size, GRAVITY / size  # where body down points
    w = sqrt(0.5 * (1.0 + z))
    return (w, -0.5 * y / w, 0.5 * x / w, 0.0)
