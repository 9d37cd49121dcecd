"""The zeros after a correction that has ended in silence: when they are due."""

ZEROS_S = 0.5
"""So long zeros are sent after a correction has ended in silence: one alone may be lost."""


class Zeros:
    """One zero each sample time `dt`, s, for ZEROS_S; wall times in s."""

    def __init__(self, dt: float) -> None:
        self._dt = dt
        self._since: float | None = None
        self._sent = 0

    @property
    def deadline(self) -> float | None:
        """When the next one is due; None while none are sent."""
        return None if self._since is None else self._since + self._sent * self._dt

    def begin(self, now: float) -> None:
        """A correction has ended in silence; nothing new while zeros are being sent."""
        if self._since is None:
            self._since, self._sent = now, 0

    def over(self) -> None:
        """Somebody is there again."""
        self._since = None

    def due(self, now: float) -> list[tuple[float, int]]:
        """When the silence was found, and how many samples after that, for each zero that is due by now."""
        since = self._since
        if since is None:
            return []
        due = []
        while since + self._sent * self._dt <= min(now, since + ZEROS_S):
            due.append((since, self._sent))
            self._sent += 1
        if self._sent * self._dt > ZEROS_S:
            self._since = None
        return due
