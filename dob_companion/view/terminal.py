"""The live view of `dob-companion run`: events scroll by above, the moment stays below.

`python -m dob_companion.view.terminal`, fed on standard input (`view/feed.py`), draws on standard error.
"""

import json
import time
from typing import Any

from dob_companion.view.drawing import axis_bars, headline, severity_style
from dob_companion.view.inlet import batches, stand_back
from dob_companion.view.lines import duration, event_line

DRAW_EVERY_S = 0.2
STALE_S = 1.0
"""Without a word of loop or vehicle for so long the view says how long it has been."""

UNKNOWN_DELAY = 255
"""The delay that stands for none known."""

_WIDEST_HALF = 40
_BESIDE_BARS = 50
"""Columns that names and numbers beside a bar take."""


class LiveView:
    """Draws what it is fed."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.live import Live

        self._console = Console(stderr=True, highlight=False)
        self._live = Live(console=self._console, auto_refresh=False, transient=True)
        self._daemon: dict[str, Any] = {}
        self._moment: dict[str, Any] = {}
        self._heard = time.monotonic()
        self._drawn = float("-inf")

    def run(self) -> None:
        """Show until the feed ends; the events stay on the terminal."""
        with self._live:
            for lines in batches(DRAW_EVERY_S):
                for line in lines:
                    self._take(json.loads(line))
                if self._moment and time.monotonic() >= self._drawn + DRAW_EVERY_S:
                    self._drawn = time.monotonic()
                    self._live.update(self._view(), refresh=True)

    def _take(self, said: dict[str, Any]) -> None:
        if "event" in said:
            line = event_line(said["at"], said["severity"], said["event"])
            self._console.print(line, style=severity_style(said["severity"]), markup=False)
        self._daemon = said.get("daemon", self._daemon)
        if "moment" in said:
            self._moment, self._heard = said["moment"], time.monotonic()

    def _view(self) -> Any:
        from rich.console import Group
        from rich.rule import Rule
        from rich.text import Text

        now, limit = self._moment, self._moment["parameters"]["DOB_LIMIT"]
        half = max(4, min(_WIDEST_HALF, (self._console.width - _BESIDE_BARS) // 2))
        silent_s = time.monotonic() - self._heard
        heard_s = now["heard_s"] or 0.0
        why = f"no news from the loop for {silent_s:.0f} s" if silent_s > STALE_S else self._why(heard_s)
        bad = max(silent_s, heard_s) > STALE_S
        rows = [
            Rule(f"dob-companion {self._daemon['version']}  design {self._daemon['design']}", style="dim"),
            headline(now["state"], Text(why, style="bold red" if bad else "", overflow="ellipsis")),
            Text(self._link_line()),
            Text(self._parameter_line()),
            axis_bars(
                self._daemon["axes"],
                [value or 0.0 for value in now["d_hat"]],
                [value or 0.0 for value in now["correction"]],
                full_scale=limit or 1.0,
                half=half,
            ),
            Text(
                f"stepped {now['stepped']}  bridged {now['bridged']}  gaps {now['gaps']}  late {now['late']}  "
                f"malformed {now['bad']}  foreign {now['foreign']}"
            ),
            Text(
                f"loop: longest turn {1e3 * now['longest_turn_s']:.1f} ms, {now['late_turns']} above a sample, "
                f"{now['cpu']:.0%} of a core",
                style="dim",
            ),
        ]
        for row in rows:
            if isinstance(row, Text):
                row.no_wrap, row.overflow = True, "ellipsis"
        return Group(*rows)

    def _why(self, heard_s: float) -> str:
        if heard_s > STALE_S:
            return f"vehicle last heard {duration(heard_s)} ago"
        if self._moment["why"]:
            return str(self._moment["why"])
        return "" if self._moment["parameters"]["DOB_ENABLE"] else "ready, DOB_ENABLE is 0"

    def _link_line(self) -> str:
        now, designed = self._moment, self._daemon["delay_samples"]
        vehicle = "no vehicle" if now["vehicle"] is None else f"vehicle {now['vehicle']}"
        known = now["delay_samples"] < UNKNOWN_DELAY
        delay = f"{now['delay_samples']} (95 %: {now['delay_p95_samples']})" if known else "unknown"
        rate = f"{now['rate_hz'] or 0.0:.1f} of {1.0 / self._daemon['dt']:.0f} Hz"
        return f"{vehicle}  {rate}  delay {delay}, designed for {designed}"

    def _parameter_line(self) -> str:
        values = self._moment["parameters"]
        axes = " ".join(name for bit, name in enumerate(self._daemon["axes"]) if int(values["DOB_AXES"]) >> bit & 1)
        return f"axes {axes or 'none'}  gain {values['DOB_GAIN']:g}  limit {values['DOB_LIMIT']:g}"


if __name__ == "__main__":
    stand_back()
    LiveView().run()
