"""Putting an excitation together: who is on the link, its parameters, the exciter, and what is left behind."""

import json
import sys
import time
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from dob_companion import __version__
from dob_companion.autopilots import autopilot_of
from dob_companion.cli.daemon import configured
from dob_companion.cli.signing import open_signing
from dob_companion.cli.times import utc
from dob_companion.companion import Companion, CompanionConfig, Event, Status
from dob_companion.doctor.listening import Listening, Stage
from dob_companion.errors import NoVehicleError, RefusedError
from dob_companion.excitation.exciter import Exciter
from dob_companion.excitation.limits import Limits
from dob_companion.excitation.plan import Plan
from dob_companion.excitation.signal import Excitation
from dob_companion.files import write_text
from dob_companion.files.tlog_writer import TlogWriter
from dob_companion.flightlog.witness import Witness
from dob_companion.mavlink import COMPANION, Severity, profiles
from dob_companion.mavlink.signing import SigningGate
from dob_companion.runtime import open_link, parse_link_url, serve
from dob_companion.runtime.links import Link
from dob_companion.runtime.listen import listen
from dob_companion.runtime.signed import SignedLink, SigningLink
from dob_companion.runtime.tapped import TappedLink

SCHEMA = "dob-companion/excitation/1"
TLOG, RESULT = "excite.tlog", "excite.json"

LISTENED_S = 2.0
"""Time to hear other companions, whose heartbeats come at 1 Hz, on top of that for streams and parameters."""

EXIT_ABORTED = 1


@dataclass(frozen=True, kw_only=True)
class Exciting:
    """One run of the command; fields as its options."""

    link: str
    out: Path
    signal: Excitation
    amplitudes: dict[str, float]
    limits: Limits
    config: Path | None
    state: Path | None
    profile: str | None
    timeout_s: float | None
    as_json: bool

    def run(self) -> int:
        """Listen, excite, write. Returns the exit code.

        Raises InputError for what cannot begin, NoVehicleError, and RefusedError where another companion is heard.
        """
        settings, _ = configured(self.config, self.state, self.profile)
        plan = Plan.of(self.signal, self.amplitudes, self.limits, 1.0 / profiles.rate_hz(settings.profile))
        url = parse_link_url(self.link)
        with ExitStack() as leaving:
            link = open_link(url)
            leaving.callback(link.close)
            signing = open_signing(settings, _say, _complain, leaving, datagrams=url.datagrams)
            gate = signing.gate if signing else None
            writer = leaving.enter_context(TlogWriter(self.out / TLOG, datagrams=url.datagrams))
            with ExitStack() as failing:
                failing.callback((self.out / TLOG).unlink, missing_ok=True)
                heard = self._listen(_tapped(link, writer, gate, signed=False), url.datagrams, gate, settings)
                failing.pop_all()
            exciter = Exciter(
                plan,
                settings,
                now=time.monotonic(),
                datagrams=url.datagrams,
                begin_by=time.monotonic() + (float("inf") if self.timeout_s is None else self.timeout_s),
                trouble=lambda: writer.trouble,
            )
            write_text(self.out / RESULT, self._result(exciter, heard, "aborted: it did not come to its end"))
            code = serve(
                exciter,
                _tapped(link, writer, gate, signed=True),
                ready=f"waiting for hover, then {', '.join(self.amplitudes)}",
                witnesses=[_Shown()],
            )
        return self._end(exciter, heard, writer, code)

    def _listen(self, link: Link, datagrams: bool, gate: SigningGate | None, settings: CompanionConfig) -> Listening:
        def names(make: str, vehicle: str) -> tuple[str, ...]:
            known = autopilot_of(make, vehicle)
            return known.names if known else ()

        def tell(stage: Stage) -> None:
            if sys.stderr.isatty() and stage is not Stage.DONE:
                _complain(f"{self.link}: {stage.value} …")

        listening = Listening(
            1.0 / profiles.rate_hz(settings.profile),
            LISTENED_S,
            None,
            now=time.monotonic(),
            datagrams=datagrams,
            gate=gate,
            profile=settings.profile,
            wanted=names,
            patience=float("inf") if self.timeout_s is None else self.timeout_s,
        )
        listen(listening, link, tell, _say)
        if listening.autopilot is None:
            raise NoVehicleError(
                f"{self.link}: no autopilot was heard within {self.timeout_s:g} s "
                f"(dob-companion doctor --link {self.link} tells more)"
            )
        if who := ", ".join(companions_heard(listening)):
            raise RefusedError(
                f"{self.link}: another companion is on the link ({who}); expected none: stop `dob-companion run` first"
            )
        return listening

    def _end(self, exciter: Exciter, heard: Listening, writer: TlogWriter, code: int) -> int:
        outcome = exciter.excitation.outcome
        result = self._result(exciter, heard, f"aborted: {writer.trouble}" if writer.trouble else outcome)
        write_text(self.out / RESULT, result)
        if self.as_json:
            print(result)
        else:
            print(f"{json.loads(result)['outcome']}; written: {self.out / TLOG}, {self.out / RESULT}")
        complete = outcome == "complete" and not writer.trouble
        return code or (0 if complete else EXIT_ABORTED)

    def _result(self, exciter: Exciter, heard: Listening, outcome: str) -> str:
        presence, loop = heard.autopilot, exciter.excitation
        content: dict[str, Any] = {
            "schema": SCHEMA,
            "generator": f"dob-companion {__version__}",
            "created": utc(),
            "outcome": outcome,
            "vehicle": {
                "system": heard.system,
                "autopilot": presence.make if presence else "",
                "kind": presence.vehicle if presence else "",
                "version": heard.version,
            },
            "profile": exciter.profile.name,
            "vehicle_axes": {
                "gyro": exciter.vehicle_axes.gyro.words,
                "moment": exciter.vehicle_axes.moment.words,
            },
            "log": TLOG,
            "dt": 1.0 / profiles.rate_hz(exciter.profile.name),
            "signal": asdict(self.signal),
            "limits": {
                "rate_rad_s": self.limits.rate,
                "tilt_rad": self.limits.tilt,
                "altitude_change_m": self.limits.altitude_change,
                "battery": self.limits.battery,
            },
            "not_told": loop.guard.unheard,
            "delay": {
                "median_samples": loop.delays.median,
                "p95_samples": loop.delays.late,
                "source": loop.delays.source,
                "round_trip_s": loop.figures().round_trip_s,
            },
            "axes": [
                {
                    "axis": passage.axis,
                    "amplitude": passage.amplitude,
                    "level": passage.level,
                    "begin_us": passage.begin_us,
                    "end_us": passage.end_us,
                    "complete": passage.complete,
                }
                for passage in loop.passages
            ],
            "parameters": heard.parameters,
        }
        return json.dumps(content, indent=1) + "\n"


def companions_heard(listening: Listening) -> list[str]:
    """Who corrects, or may: another companion of the same vehicle, and whose corrections were heard."""
    alike = {who for who in listening.presences if who.component == COMPANION and who.system == listening.system}
    return sorted(f"{other.system}/{other.component}" for other in alike | listening.correctors)


class _Shown(Witness):
    """Events as lines; on a terminal also how far it is."""

    def __init__(self) -> None:
        self.watches = sys.stderr.isatty()
        self._shown = ""

    def event(self, event: Event) -> None:
        """A line of its own."""
        self._clear()
        _say(event)

    def status(self, companion: Companion, status: Status) -> None:
        """The line that is written again and again."""
        if not isinstance(companion, Exciter):
            return
        progress = companion.excitation.progress
        self._clear()
        if progress is not None:
            self._shown = f"{progress[0]} {100.0 * progress[1]:3.0f} %, {max(map(abs, status.correction)):.3f}"
            print(self._shown, end="\r", file=sys.stderr, flush=True)

    def _clear(self) -> None:
        if self._shown:
            print(" " * len(self._shown), end="\r", file=sys.stderr, flush=True)
        self._shown = ""


def _tapped(link: Link, writer: TlogWriter, gate: SigningGate | None, *, signed: bool) -> TappedLink:
    """What the log holds is what has been let in."""
    inner = link if gate is None else (SignedLink if signed else SigningLink)(link, gate)
    return TappedLink(inner, lambda data: writer.heard(data, time.time()), lambda data: writer.said(data, time.time()))


def _say(event: Event) -> None:
    _complain(event.text if event.severity > Severity.WARNING else f"{event.severity.name}: {event.text}")


def _complain(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
