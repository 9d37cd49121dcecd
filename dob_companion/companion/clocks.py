"""Whether gyro and moments are stamped by one clock. Samples of two clocks cannot be brought together."""

import math

FAR = 5.0
"""Distance, in dt, from a moment's stamp to that of the gyro sample before it that no order of arrival explains."""

PATIENCE_S = 0.5
"""Samples worth so much time, every one of them that far away, make two clocks."""


class ClockCheck:
    """Told of both streams as they arrive. Only a moment right after a gyro sample counts, so that a stream that has
    stopped is not taken for another clock."""

    def __init__(self, dt: float) -> None:
        self._far_us = FAR * 1e6 * dt
        self._patience = math.ceil(PATIENCE_S / dt)
        self._gyro: int | None = None
        self._far = 0
        self._offset_us: int | None = None

    def gyro(self, stamp_us: int) -> None:
        """A new gyro sample."""
        self._gyro = stamp_us

    def moment(self, stamp_us: int) -> None:
        """A moment, late and early ones included."""
        gyro, self._gyro = self._gyro, None
        if gyro is None:
            return
        offset = stamp_us - gyro
        if abs(offset) <= self._far_us:
            self._far, self._offset_us = 0, None
            return
        self._far += 1
        if self._far >= self._patience:
            self._offset_us = offset

    @property
    def offset_s(self) -> float | None:
        """How far the moments' clock is ahead of the gyro's, s; None while they are one."""
        return None if self._offset_us is None else 1e-6 * self._offset_us

    @property
    def why(self) -> str:
        """What is wrong, in words; "" when nothing is."""
        offset = self.offset_s
        return "" if offset is None else f"moments are stamped by another clock than the gyro: {seconds(offset)}"


def seconds(offset: float) -> str:
    """A signed time in words, to the millisecond where that matters."""
    return f"{offset:+.3f} s" if abs(offset) < 1.0 else f"{offset:+.1f} s"
