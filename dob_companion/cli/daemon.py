"""Putting the daemon together: a checked design, a configuration, a link, and somewhere to log."""

import json
import signal
import sys
import time
from collections.abc import Mapping
from contextlib import ExitStack, closing
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from dob_companion.artifact import DobDesign, check_flyable, loads
from dob_companion.cli.carried_over import CarriedOver
from dob_companion.cli.times import utc
from dob_companion.cli.waiting import Waiting
from dob_companion.companion import Companion, CompanionConfig, Event, Status, parse_config
from dob_companion.companion.parameters import limits_in_words
from dob_companion.files import read_text
from dob_companion.files.recorder import FlightRecorder
from dob_companion.flightlog.witness import Witness
from dob_companion.mavlink import profiles
from dob_companion.runtime import Notifier, open_link, parse_link_url, serve
from dob_companion.supervisor.monitors import UNKNOWN_AGE
from dob_companion.view.feed import Feed, LoopClock, live_view_fits
from dob_companion.view.lines import Lines, duration, event_line

STALE_S = 1.0
"""A vehicle that was not heard for so long is said to be so."""


def fly(
    design_path: Path,
    link_url: str,
    *,
    profile: str | None,
    config: Path | None,
    state: Path | None,
    record: Mapping[str, Any],
    timeout_s: float | None,
    page_port: int | None,
    as_json: bool,
) -> int:
    """Check the design, open the link, serve until told to stop. Returns the exit code.

    `profile`, `state` and `record`, keys of `Recording`, go before what the configuration says.
    """
    settings, text = configured(config, state, profile)
    design = load_flyable(design_path, settings.profile)
    settings = replace(settings, record=replace(settings.record, **record))
    url = parse_link_url(link_url)
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)  # `stty tostop`: writing in the background must not stop us
    with closing(Lines(sys.stdout if as_json else sys.stderr)) as lines:
        feed = Feed(lambda event: lines.write(_as_json(event) if as_json else _as_text(event)))
        show = feed.event
        notifier = Notifier.from_environment()
        with ExitStack() as leaving:
            link = open_link(url)
            leaving.callback(link.close)
            _open_views(feed, page_port, leaving, live=not as_json and live_view_fits())
            feed.introduce(design, str(url))
            show(Event.info(f"design {design.sha256[:8]}: {', '.join(block.name for block in design.blocks)}"))
            keeping = CarriedOver(settings, show, leaving)
            link = keeping.signed(link, url.datagrams)
            companion = Companion(design, keeping.settings, now=time.monotonic(), datagrams=url.datagrams)
            show(Event.info(limits_in_words(design, companion.parameters["DOB_LIMIT"])))

            clock = LoopClock(design.dt)
            witnesses: list[Witness] = [
                clock,
                _Shown(feed, clock, lines if as_json else None),
                _Alive(notifier),
                keeping,
                Waiting(
                    url, settings.system, show, time.monotonic(), makes=companion.profile.makes, design=str(design_path)
                ),
            ]
            if settings.record.dir is not None:
                recorder = FlightRecorder(
                    Path(settings.record.dir),
                    companion,
                    design,
                    text,
                    now=time.monotonic(),
                    datagrams=url.datagrams,
                    mb=settings.record.mb,
                    segments=settings.record.segments,
                    profile=settings.profile,
                )
                leaving.callback(recorder.close)
                witnesses.insert(0, recorder)
                show(Event.info(f"recording flight {recorder.flight} to {settings.record.dir}"))
            leaving.callback(notifier.stopping)
            ready = f"listening on {url}, waiting for a vehicle"
            code = serve(companion, link, ready=ready, timeout_s=timeout_s, witnesses=witnesses)
        show(Event.info(_summary(companion.status(), lines.left_out)))
        return code


def configured(config: Path | None, state: Path | None, profile: str | None) -> tuple[CompanionConfig, str]:
    """The configuration, `--state` and `--profile` before what it says, and its text. Raises InputError, one line."""
    text = read_text(config) if config else ""
    settings = parse_config(text, str(config))
    if state is not None:
        settings = replace(settings, state_directory=str(state))
    return (settings if profile is None else replace(settings, profile=profile)), text


def load_flyable(path: Path, profile: str) -> DobDesign:
    """Read a design and refuse it, with DesignFileError, unless it may be flown."""
    design = loads(read_text(path), str(path))
    check_flyable(design, profiles.rate_hz(profile), str(path))
    return design


class _Shown(Witness):
    """The log and the views; `lines` takes each status as JSON."""

    def __init__(self, feed: Feed, clock: LoopClock, lines: Lines | None) -> None:
        self._feed, self._clock, self._lines = feed, clock, lines
        self.watches = lines is not None or feed.watched

    def event(self, event: Event) -> None:
        """To everybody who watches."""
        self._feed.event(event)

    def status(self, companion: Companion, status: Status) -> None:
        """To the views, and as a line."""
        self._feed.moment(companion, status, self._clock)
        if self._lines:
            self._lines.write(_status_as_json(status))


class _Alive(Witness):
    """Tells systemd."""

    def __init__(self, notifier: Notifier) -> None:
        self._notifier = notifier

    def begins(self, companion: Companion, now: float) -> None:
        """Feed the watchdog."""
        self._notifier.alive(now, lambda: _in_words(companion.status()))


def _in_words(status: Status) -> str:
    if status.heard_s is not None and status.heard_s > STALE_S:
        return f"{status.state.name}, vehicle last heard {duration(status.heard_s)} ago"
    delay = f"delay {status.delay_samples} samples" if status.delay_samples < UNKNOWN_AGE else "delay unknown"
    return f"{status.state.name}, {status.rate_hz:.1f} Hz, {delay}"


def _summary(status: Status, left_out: int) -> str:
    lost = f", {left_out} log lines left out" if left_out else ""
    return (
        f"stopped: {status.stepped} samples stepped, {status.bridged} bridged, {status.gaps} gaps, "
        f"{status.late} late, {status.bad} malformed, {status.foreign} foreign{lost}"
    )


def _open_views(feed: Feed, page_port: int | None, leaving: ExitStack, *, live: bool) -> None:
    """The page first: a port in use is told as one line, before anything is drawn."""
    leaving.callback(feed.close)
    address = feed.open_page(page_port) if page_port is not None else None
    if live:
        feed.open_terminal()
    if address:
        feed.event(Event.info(f"status page on {address}"))


def _as_text(event: Event) -> str:
    return event_line(time.time(), event.severity.name, event.text)


def _as_json(event: Event) -> str:
    return json.dumps({"time": utc(), "event": event.text, "severity": event.severity.name})


def _status_as_json(status: Status) -> str:
    return json.dumps({"time": utc(), "status": asdict(status) | {"state": status.state.name}})
