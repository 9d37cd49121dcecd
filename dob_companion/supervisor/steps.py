"""The first enabling in a flight: a share of the correction for a while, the loop watched, then more."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FirstEnabling:
    """How a correction that has not yet been carried in this flight is faded in.

    shares   of the correction, rising, each between 0 and 1, on the way to the whole; none: it fades in at once
    seconds  for which it stays at each of them
    """

    shares: tuple[float, ...] = (0.3,)
    seconds: float = 1.0


class Steps:
    """What the fade f goes to: a share, and the whole once the shares have been carried without trouble.

    A fade-in that is broken off begins again with the first share; one that has come to the end is the last of its kind
    until `forget`: what was carried once in a flight fades in at once.
    """

    __slots__ = ("_at", "_done", "_held", "_patience", "_shares")

    def __init__(self, plan: FirstEnabling, dt: float) -> None:
        self._shares = plan.shares
        self._patience = round(plan.seconds / dt)
        self.forget()

    def forget(self) -> None:
        """A flight is over: the next enabling is a first one."""
        self._at = self._held = 0
        self._done = not self._shares

    def target(self, f: float, fade_in: bool) -> float:
        """Where f is to go, one call a sample."""
        if self._done:
            return 1.0 if fade_in else 0.0
        if not fade_in:
            self._at = self._held = 0
            return 0.0
        if self._at == len(self._shares):
            self._done = f == 1.0
            return 1.0
        share = self._shares[self._at]
        if f >= share:
            self._held += 1
            if self._held >= self._patience:
                self._at, self._held = self._at + 1, 0
        return share
