"""Putting the daemon together: a checked design, a configuration, a link, and somewhere to log."""

import json
import sys
import time
from contextlib import ExitStack
from dataclasses import asdict, replace
from pathlib import Path

from dob_companion.artifact import DobDesign, check_flyable, loads
from dob_companion.cli.keeping import Keeping
from dob_companion.companion import Companion, Event, Status, parse_config
from dob_companion.files import read_text
from dob_companion.files.recorder import FlightRecorder, Recording
from dob_companion.runtime import Notifier, open_link, parse_link_url, serve

RATE_HZ = 250.0
"""The rate at which profile `sitl` delivers samples; a design for another one is refused."""


def fly(
    design_path: Path,
    link_url: str,
    *,
    config: Path | None,
    state: Path | None,
    recording: Recording | None,
    timeout_s: float | None,
    as_json: bool,
) -> int:
    """Check the design, open the link, serve until told to stop. Returns the exit code."""
    design = load_flyable(design_path)
    text = read_text(config) if config else ""
    settings = parse_config(text, str(config))
    if state is not None:
        settings = replace(settings, state_directory=str(state))
    url = parse_link_url(link_url)
    show = _as_json if as_json else _as_text
    notifier = Notifier.from_environment()
    with ExitStack() as leaving:
        link = open_link(url)
        leaving.callback(link.close)
        show(Event.info(f"design {design.sha256[:8]}: {', '.join(block.name for block in design.blocks)}"))
        keeping = Keeping(settings, show, leaving)
        link = keeping.signed(link, url.datagrams)
        companion = Companion(design, keeping.settings, now=time.monotonic(), datagrams=url.datagrams)

        def turn(now: float) -> None:
            notifier.alive(now, lambda: _in_words(companion.status()))
            keeping.turn(now, companion)

        recorder = None
        if recording is not None:
            recorder = FlightRecorder(recording, companion, design, text, now=time.monotonic(), datagrams=url.datagrams)
            leaving.callback(recorder.close)
            show(Event.info(f"recording flight {recorder.flight} to {recording.directory}"))
        leaving.callback(notifier.stopping)
        code = serve(
            companion,
            link,
            ready=f"listening on {url}, waiting for a vehicle",
            timeout_s=timeout_s,
            on_event=show,
            on_status=_status_as_json if as_json else None,
            on_turn=turn,
            witness=recorder,
        )
    show(Event.info(_summary(companion.status())))
    return code


def load_flyable(path: Path) -> DobDesign:
    """Read a design and refuse it, with DesignFileError, unless it may be flown."""
    design = loads(read_text(path), str(path))
    check_flyable(design, RATE_HZ, str(path))
    return design


def _in_words(status: Status) -> str:
    return f"{status.state.name}, {status.rate_hz:.1f} Hz, delay {status.delay_samples} samples"


def _summary(status: Status) -> str:
    return (
        f"stopped: {status.stepped} samples stepped, {status.bridged} bridged, {status.gaps} gaps, "
        f"{status.late} late, {status.bad} malformed, {status.foreign} foreign"
    )


def _as_text(event: Event) -> None:
    print(f"{time.strftime('%H:%M:%S')} {event.severity.name.lower():8} {event.text}", file=sys.stderr, flush=True)


def _as_json(event: Event) -> None:
    print(json.dumps({"event": event.text, "severity": event.severity.name}), flush=True)


def _status_as_json(status: Status) -> None:
    print(json.dumps({"status": asdict(status) | {"state": status.state.name}}), flush=True)
