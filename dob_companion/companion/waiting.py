"""Why nothing is injected although the operator has switched on, in words, once for each reason."""

import re

PATIENCE_S = 3.0
"""How long a reason must stand: settling and measuring pass by themselves."""

_NUMBERS = re.compile(r"[\d.]+")


class Waiting:
    """A reason counts as the same whatever numbers are in it. Times in s."""

    def __init__(self) -> None:
        self._told: set[str] = set()
        self._kind = ""
        self._since = 0.0

    def said(self, why: str) -> None:
        """This reason was given on another occasion."""
        self._told.add(_NUMBERS.sub("", why))

    def over(self) -> None:
        """It injects, or is off: from now on every reason is news again."""
        self._told.clear()
        self._kind = ""

    def news(self, why: str, now: float) -> str:
        """The reason that stands at `now`, if it has stood for long and has not been told; else ""."""
        kind = _NUMBERS.sub("", why)
        if kind != self._kind:
            self._kind, self._since = kind, now
        if not kind or kind in self._told or now - self._since < PATIENCE_S:
            return ""
        self._told.add(kind)
        return why
