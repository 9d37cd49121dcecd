"""What every room counts with: the sample time, gravity, the three axes."""

DT = 0.004
"""Sample time, s: the paper's attitude loop runs at 250 Hz (beside Eq. (10))."""

DT_US = round(DT * 1e6)
"""The same in µs, the unit of stamps."""

GRAVITY = 9.80665
"""Standard gravity, m/s² (ISO 80000-3)."""

AXES = ("roll", "pitch", "yaw")
"""Names of the hover axes x, y, z."""
