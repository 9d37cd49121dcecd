"""Reading an autopilot's parameters by name, a few at a time: asked again when lost, given up when nobody answers."""

AT_ONCE = 12
"""Requests that are open together: ArduPilot keeps a queue of 20, and a radio's link has little room."""

RETRY_S = 0.7
TRIES = 3
"""A parameter asked for so often, each time with RETRY_S to answer, is one that the autopilot does not have."""


class ParameterReading:
    """Which of `names` to ask for next. Times in s."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self._left = dict.fromkeys(names, 0)
        self._open: dict[str, float] = {}

    def due(self, now: float) -> list[str]:
        """Names to ask for now."""
        for name in [name for name, until in self._open.items() if now >= until]:
            del self._open[name]
            if self._left[name] >= TRIES:
                del self._left[name]
        waiting = sorted((name for name in self._left if name not in self._open), key=self._left.__getitem__)
        asked = waiting[: AT_ONCE - len(self._open)]
        for name in asked:
            self._left[name] += 1
            self._open[name] = now + RETRY_S
        return asked

    def told(self, name: str) -> None:
        """It has been told, asked for or not."""
        self._left.pop(name, None)
        self._open.pop(name, None)

    @property
    def done(self) -> bool:
        """Whether each has been told or given up."""
        return not self._left

    @property
    def deadline(self) -> float:
        """When `due` must be asked again; at once where more may be asked for."""
        if self._left and len(self._open) < min(AT_ONCE, len(self._left)):
            return float("-inf")
        return min(self._open.values(), default=float("inf"))
