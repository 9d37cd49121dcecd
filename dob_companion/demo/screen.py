"""What the demo shows while it runs: a live view on a terminal, plain lines anywhere else."""

import sys
from typing import Any, Protocol

from dob_companion.artifact import AXES, DobDesign
from dob_companion.ground import Telemetry
from dob_companion.supervisor import State
from dob_companion.view.drawing import axis_bars, headline


class Screen(Protocol):
    """The places where the demo says something."""

    def act(self, name: str, about: str) -> None:
        """A new act begins."""

    def certificate(self, design: DobDesign) -> None:
        """The design is there."""

    def text(self, text: str) -> None:
        """A STATUSTEXT came in."""

    def telemetry(self, telemetry: Telemetry | None) -> None:
        """The newest telemetry, several times a second."""

    def note(self, text: str) -> None:
        """Something worth keeping."""

    def done(self) -> None:
        """The last act is over."""


def certificate_lines(design: DobDesign) -> list[str]:
    """The certificate, a line a block."""
    head = (
        f"{'block':6}{'gamma*':>8}{'gamma':>9}{'order':>6}{'slowest mode':>13}"
        f"{'disk margin':>12}{'delay margin':>13}{'bandwidth':>10}"
    )
    rows = [
        f"{block.name:6}{c.gamma_star:>8.5f}{c.gamma:>9.5f}{block.observer.order:>6}{1e3 * c.slowest_mode_s:>10.1f} ms"
        f"{c.disk_margin:>12.3f}{c.delay_margin_samples:>5} samples{c.estimation_bandwidth_hz:>7.2f} Hz"
        for block in design.blocks
        for c in [block.certificate]
    ]
    return [head, *rows]


class PlainScreen:
    """Lines on stderr, for pipes and logs; no progress, only what happened."""

    def act(self, name: str, about: str) -> None:
        """Print the act."""
        self.note(f"[{name}] {about}")

    def certificate(self, design: DobDesign) -> None:
        """Print the certificate."""
        for line in certificate_lines(design):
            self.note(line)

    def text(self, text: str) -> None:
        """Print the text."""
        self.note(text)

    def telemetry(self, telemetry: Telemetry | None) -> None:
        """Nothing: numbers in motion are for terminals."""

    def note(self, text: str) -> None:
        """Print a line."""
        print(text, file=sys.stderr, flush=True)

    def done(self) -> None:
        """Nothing is left to do."""


class Silent:
    """Shows nothing."""

    def act(self, name: str, about: str) -> None:
        """Nothing."""

    def certificate(self, design: DobDesign) -> None:
        """Nothing."""

    def text(self, text: str) -> None:
        """Nothing."""

    def telemetry(self, telemetry: Telemetry | None) -> None:
        """Nothing."""

    def note(self, text: str) -> None:
        """Nothing."""

    def done(self) -> None:
        """Nothing."""


class LiveScreen:
    """A view that stays in place: acts and texts above, state, rate, delay and d_hat bars below."""

    def __init__(self, flight_s: float) -> None:
        from rich.console import Console
        from rich.live import Live

        self._flight_s = flight_s
        self._newest: Telemetry | None = None
        self._console = Console(stderr=True, highlight=False)
        self._live = Live(console=self._console, refresh_per_second=10, transient=True, get_renderable=self._view)
        self._first_stamp: int | None = None
        self._showing = False

    def act(self, name: str, about: str) -> None:
        """Print the act; the flight's view opens with its first telemetry."""
        self._hide()
        self._console.print(f"[bold]{name}[/bold]  {about}")

    def certificate(self, design: DobDesign) -> None:
        """Print the certificate."""
        for line in certificate_lines(design):
            self._console.print(f"  {line}", style="dim" if line.startswith("block") else None, markup=False)

    def text(self, text: str) -> None:
        """Print the text above the view."""
        self._console.print(f"  {text}", markup=False)

    def telemetry(self, telemetry: Telemetry | None) -> None:
        """Take the newest numbers."""
        if telemetry is None:
            return
        self._newest = telemetry
        if self._first_stamp is None:
            self._first_stamp = telemetry.stamp_us
        if not self._showing:
            self._showing = True
            self._live.start()

    def note(self, text: str) -> None:
        """Print a line that stays."""
        self._hide()
        self._console.print(f"  {text}", markup=False)

    def done(self) -> None:
        """Close the view."""
        self._hide()

    def _hide(self) -> None:
        if self._showing:
            self._showing = False
            self._live.stop()

    def _view(self) -> Any:
        from rich.console import Group
        from rich.progress_bar import ProgressBar
        from rich.text import Text

        seen = self._newest
        if seen is None or self._first_stamp is None:
            return Text("")
        elapsed = (seen.stamp_us - self._first_stamp) * 1e-6
        top = headline(
            State(seen.state).name,
            f"{seen.rate_hz:6.1f} Hz",
            f"delay {seen.delay_samples}",
            ProgressBar(total=self._flight_s, completed=min(elapsed, self._flight_s), width=30),
            f"{elapsed:5.1f} s",
        )
        return Group(top, axis_bars(AXES, seen.d_hat))


def screen_for(flight_s: float) -> Screen:
    """The live view when stderr is a terminal and rich is there; else plain lines."""
    if not sys.stderr.isatty():
        return PlainScreen()
    try:
        return LiveScreen(flight_s)
    except ModuleNotFoundError:
        return PlainScreen()
