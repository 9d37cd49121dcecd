"""Whether the loop may have real-time priority: a decision, fed with time. `runtime/priority.py` carries it out.

Under SCHED_FIFO a loop that does not sleep keeps everything else of its priority and below from running: the network
and the disk, the ground station beside it, the shell that would stop it. A flood on the link does that, as does a
simulated vehicle that flies faster than time. So real time is for a loop with time left over. One that needs more than
`MOST_SHARE` of a core over a second gives it up, and gets it back after `CALM_S` in which no second was like that.
"""

WINDOW_S = 1.0
MOST_SHARE = 0.5
"""Four times what the loop needs at 250 Hz on an ordinary computer."""

CALM_S = 10.0


class Leash:
    """`cpu_s` is the loop's own processor time so far. `granted` is the decision."""

    def __init__(self, now: float, cpu_s: float) -> None:
        self.granted = True
        self._calm_since = now
        self._from = now, cpu_s

    @property
    def due(self) -> float:
        """When to look again."""
        return self._from[0] + WINDOW_S

    def look(self, now: float, cpu_s: float) -> str:
        """Judge the time since the last look. Returns what has been decided, in words, or "" when nothing has."""
        since, before = self._from
        self._from = now, cpu_s
        share = (cpu_s - before) / max(now - since, WINDOW_S)
        if share > MOST_SHARE:
            return self._give_up(now, f"the loop took {share:.0%} of a core for a second")
        if self.granted or now - self._calm_since < CALM_S:
            return ""
        self.granted = True
        return "real-time scheduling again"

    def overran(self, now: float, run_s: float) -> str:
        """The loop ran for `run_s` without sleeping once. Returns words as `look` does."""
        return self._give_up(now, f"the loop ran for {run_s:g} s without a pause")

    def _give_up(self, now: float, why: str) -> str:
        self._calm_since = now
        if not self.granted:
            return ""
        self.granted = False
        return f"real-time scheduling given up: {why}; back after {CALM_S:g} s of calm"
