"""What was heard on a link, judged: findings with their remedies, and which profile fits. Pure."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dob_companion.artifact import DobDesign
from dob_companion.companion.parameters import UNKNOWN_LIMIT
from dob_companion.companion.samples import WHOLE
from dob_companion.doctor.finding import Finding, Verdict
from dob_companion.doctor.listening import Listening
from dob_companion.doctor.settings import settings
from dob_companion.doctor.streamlog import StreamLog
from dob_companion.mavlink import Input
from dob_companion.mavlink.profiles import AgeSource
from dob_companion.mavlink.signing import Signature
from dob_companion.observer import MISREAD, misread_by, missing_samples
from dob_companion.supervisor import percentile
from dob_companion.supervisor.monitors import FULL_RATE, LATE

ONE_SAMPLE = (1, 3)
"""Link delay designed for and delay margin, in samples, that are assumed where no design is given."""

NOTABLE_DRIFT_PERCENT, BAD_DRIFT_PERCENT = 0.1, 2.0
OWN_RATE = 0.6
"""Least rate, of the design's, of a moment that is read beside the rate controller and comes when it is read: what
`identify` wants. How long none may come is judged by the design."""
NOTABLE_SHARE = 0.01
NEAR = 1.5
"""Share of MISREAD that is still well: how often a script runs changes from minute to minute."""
MOST_SHOWN = 5
"""Numbers of unknown messages that are listed."""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """All findings. `fit` is True when nothing that `run` needs is missing; `profile` names the best match, or None."""

    fit: bool
    profile: str | None
    findings: tuple[Finding, ...]


def diagnose(heard: Listening, design: DobDesign | None) -> Diagnosis:
    """Judge what was heard, for a design or, without one, for its profile's rate and one sample of delay."""
    rate_hz = 1.0 / design.dt if design else heard.profile.rate_hz
    findings = [*_who(heard), *_signing(heard)]
    profile = None
    if heard.autopilot is not None:
        profile = _best_profile(heard, rate_hz)
        findings += [
            *_requests(heard),
            *settings(heard.autopilot.make, heard.parameters, rate_hz),
            *_inputs(heard, rate_hz),
            *_stamps(heard, design),
            *_delay(heard, rate_hz, design),
            *_signs(heard, design),
            *_limit(design),
            *_profile(heard, rate_hz),
        ]
    fit = all(finding.verdict is not Verdict.MISSING for finding in findings)
    return Diagnosis(fit, profile, tuple(findings))


# Who is there ---------------------------------------------------------------------------------------------------


def _who(heard: Listening) -> Iterator[Finding]:
    autopilots = [presence for presence in heard.presences.values() if presence.make]
    if not autopilots:
        yield _nobody(heard)
    for presence in autopilots:
        state = "armed" if presence.armed else "disarmed"
        version = f" {heard.version}" if heard.version and presence is heard.autopilot else ""
        text = f"system {presence.sender.system}: {presence.make}{version} autopilot of a {presence.vehicle}, {state}"
        yield Finding(Verdict.OK, "autopilot", text)
    if len(autopilots) > 1:
        systems = ", ".join(str(presence.sender.system) for presence in autopilots)
        text = f"{len(autopilots)} autopilots on one link: systems {systems}"
        yield Finding(Verdict.MISSING, "autopilot", text, "one link for each vehicle")
    for other in heard.presences.values():
        if not other.make:
            text = f"{other.sender.system}/{other.sender.component}: {other.vehicle}"
            if other.sender.component == 191:
                remedy = "stop it first: systemctl stop dob-companion"
                yield Finding(Verdict.MISSING, "companion", f"another companion is on the link, {text}", remedy)
            else:
                yield Finding(Verdict.NOTE, "component", text)
    if heard.listener.bad:
        text = f"{heard.listener.bad} pieces of garbage"
        yield Finding(Verdict.NOTE, "link", text, "wiring, baud rate, or another protocol on the same link")
    if unknown := heard.listener.unknown:
        numbers = ", ".join(f"{number}" for number, _ in unknown.most_common(MOST_SHOWN)) + ", …" * (
            len(unknown) > MOST_SHOWN
        )
        text = f"{unknown.total()} messages of another MAVLink dialect, left alone: numbers {numbers}"
        yield Finding(Verdict.OK, "link", text)
    if heard.listener.echoes:
        text = f"{heard.listener.echoes} messages of our own came back"
        yield Finding(Verdict.NOTE, "link", text, "a loop in the routing, or a line whose ends are joined")


def _signing(heard: Listening) -> Iterator[Finding]:
    if heard.autopilot is None:
        return
    own = heard.signatures[heard.autopilot.sender]
    count = own.total()
    if not heard.checked:
        if own[Signature.UNCHECKED]:
            text = (
                f"{own[Signature.UNCHECKED]} of {count} messages of the autopilot are signed, with a key not given here"
            )
            remedy = "signing_key_file for `run`, and doctor again with the same --config (docs/links.md)"
            yield Finding(Verdict.NOTE, "signing", text, remedy)
        else:
            yield Finding(Verdict.OK, "signing", "the autopilot does not sign; `run` without a key takes what it says")
        return
    refused = count - own[Signature.ADMITTED]
    text = f"{own[Signature.ADMITTED]} of {count} messages of the autopilot are signed with our key"
    if refused:
        verdict = Verdict.MISSING if refused > NOTABLE_SHARE * count else Verdict.NOTE
        worst = max(_SIGNING_REMEDIES, key=lambda kind: own[kind])
        text += "; refused: " + ", ".join(f"{own[kind]} {kind}" for kind in _SIGNING_REMEDIES if own[kind])
        yield Finding(verdict, "signing", text, _SIGNING_REMEDIES[worst])
    else:
        yield Finding(Verdict.OK, "signing", text)
    for sender, kinds in heard.signatures.items():
        if sender != heard.autopilot.sender and not kinds[Signature.ADMITTED]:
            yield Finding(
                Verdict.NOTE,
                "signing",
                f"{sender.system}/{sender.component}: nothing signed with our key, `run` will not hear it",
            )


_SIGNING_REMEDIES = {
    Signature.UNSIGNED: "turn signing on in the autopilot, for this link and with the same key (docs/links.md)",
    Signature.WRONG: "the autopilot has another key: set up the same one in both",
    Signature.REPLAYED: "old timestamps: set both clocks; does a router deliver messages twice or out of order?",
}


def _nobody(heard: Listening) -> Finding:
    if heard.presences:
        who = ", ".join(f"{p.sender.system}/{p.sender.component}" for p in heard.presences.values())
        return Finding(
            Verdict.MISSING, "autopilot", f"only {who} heard, no autopilot (component 1)", "connect it to this link"
        )
    if heard.listener.bad or heard.listener.unknown:
        return Finding(
            Verdict.MISSING, "autopilot", "bytes arrive, but no MAVLink heartbeat", "baud rate; SERIALn_PROTOCOL 2"
        )
    return Finding(
        Verdict.MISSING,
        "autopilot",
        "nothing is heard",
        "cable and baud rate; for udpin, does the vehicle send to this address and port?",
    )


# What it sends --------------------------------------------------------------------------------------------------


def _requests(heard: Listening) -> Iterator[Finding]:
    for name, answer in heard.answers.items():
        if answer is None:
            text = f"{name}: the request for its rate is not answered"
            yield Finding(Verdict.NOTE, "requests", text, "let commands of component 191 through; is signing on?")
        elif not answer:
            yield Finding(Verdict.NOTE, "requests", f"{name}: the vehicle refuses to send it at this rate")


def _inputs(heard: Listening, rate_hz: float) -> Iterator[Finding]:
    for what in (Input.GYRO, Input.MOMENT):
        name, topic = heard.profile.stream(what).name, what.value
        stream = heard.stream(name)
        if stream is None or not stream.stamped:
            yield Finding(Verdict.MISSING, topic, f"no {name}", _how_to_get(heard, what))
            continue
        stamp, wall = stream.rate_by_stamp_hz, stream.rate_by_wall_hz
        enough = stamp >= _least_rate(heard, what) * rate_hz
        text = f"{name} at {stamp:.1f} Hz by its stamps, {wall:.1f} Hz by this clock, of {rate_hz:g} Hz"
        remedy = "" if enough else _how_to_speed_up(heard)
        yield Finding(Verdict.OK if enough else Verdict.MISSING, topic, text, remedy)
    if not heard.finite:
        yield Finding(Verdict.MISSING, "gyro", "rates that are not finite", "the autopilot's gyro is not healthy")
    elif len(heard.rates_seen) == 1:
        text = "the rates never change, not even by noise"
        yield Finding(Verdict.MISSING, "gyro", text, f"gyro calibrated and running? {_inputs_of(heard)[0]} filled in?")


def _least_rate(heard: Listening, what: Input) -> float:
    return OWN_RATE if heard.profile.stream(what).unasked else FULL_RATE


def _inputs_of(heard: Listening) -> tuple[str, str]:
    """The messages that bring gyro rates and applied moment."""
    profile = heard.profile
    return profile.stream(Input.GYRO).name, profile.stream(Input.MOMENT).name


def _how_to_get(heard: Listening, what: Input) -> str:
    if what is Input.MOMENT:
        return heard.profile.remedy
    return "a message interval for it on this link (MAV_CMD_SET_MESSAGE_INTERVAL, or the autopilot's stream settings)"


def _how_to_speed_up(heard: Listening) -> str:
    own = heard.profile.speed_remedy
    return f"{own}; " * bool(own) + "921600 baud or UDP, a link of its own, fewer other streams on it"


def _stamps(heard: Listening, design: DobDesign | None) -> Iterator[Finding]:
    for wanted in (heard.profile.stream(Input.GYRO), heard.profile.stream(Input.MOMENT)):
        name, stream = wanted.name, heard.stream(wanted.name)
        if stream is None or not stream.stamped:
            continue
        yield Finding(Verdict.OK, "stamps", f"{name}: {stream.pattern()}")
        gaps = 0 if wanted.unasked else stream.gaps
        for count, what in ((gaps, "gaps"), (stream.backward, "stamps that do not increase")):
            if count > NOTABLE_SHARE * len(stream.stamps):
                text = f"{name}: {count} {what} in {len(stream.stamps)}"
                yield Finding(
                    Verdict.NOTE, "stamps", text, "a lossy or overfull link, or a vehicle that sends in steps"
                )
    if design:
        yield from _silences(heard, design)
        yield from _readings(heard, design)
    if heard.clocks.why:
        remedy = "stamp both with the time of the gyro sample (docs/interfaces.md, the vehicle)"
        yield Finding(Verdict.MISSING, "clock", heard.clocks.why, remedy)
    gyro = heard.stream(_inputs_of(heard)[0])
    if gyro is not None and gyro.stamped:
        yield from _drift(gyro)


def _silences(heard: Listening, design: DobDesign) -> Iterator[Finding]:
    """The longest silence of each stream, beside what the design bears of it."""
    for name, borne in zip(_inputs_of(heard), missing_samples(design), strict=True):
        stream = heard.stream(name)
        if stream is None or not stream.stamped:
            continue
        longest, allowed = float(np.max(stream.intervals_ms)), 1e3 * design.dt * (borne + 1 + WHOLE)
        text = f"{name}: longest {longest:.3g} ms; the design bears {borne} missing in a row, {allowed:.3g} ms"
        too_long = int(np.sum(stream.intervals_ms > allowed))
        if too_long:
            text += f"; {too_long} times longer, a fade each time"
        remedy = "a lossy or overfull link, or a vehicle that sends too rarely" if too_long else ""
        yield Finding(Verdict.NOTE if too_long else Verdict.OK, "silence", text, remedy)


def _readings(heard: Listening, design: DobDesign) -> Iterator[Finding]:
    """Whether the design bears that the moment is read beside the controller, as often as that is done."""
    wanted = heard.profile.stream(Input.MOMENT)
    stream = heard.stream(wanted.name)
    if not wanted.unasked or stream is None or not stream.stamped:
        return
    hz = stream.rate_by_stamp_hz
    share = misread_by(design, hz)
    text = f"the moment is read {hz:.0f} times a second; what that misses comes back as {share:.2g} of it"
    if share <= MISREAD * NEAR:
        yield Finding(Verdict.OK, "readings", text)
    else:
        remedy = f"design with moment_rate_hz = {hz:.0f} in [auto]: above {MISREAD:g} this one may ring"
        yield Finding(Verdict.NOTE, "readings", text, remedy)


def _drift(stream: StreamLog) -> Iterator[Finding]:
    drift, error = stream.drift_percent()
    if abs(drift) < max(NOTABLE_DRIFT_PERCENT, 2.0 * error):
        return
    text = f"the vehicle's clock runs {abs(drift):.2f} ± {error:.2f} % {'fast' if drift > 0 else 'slow'}"
    if abs(drift) < BAD_DRIFT_PERCENT:
        yield Finding(Verdict.NOTE, "clock", f"{text}: followed, everything runs on its stamps")
    else:
        yield Finding(Verdict.MISSING, "clock", text, "a simulation slower than real time, or a link that falls behind")


# Delay, signs ---------------------------------------------------------------------------------------------------


def _delay(heard: Listening, rate_hz: float, design: DobDesign | None) -> Iterator[Finding]:
    delay, margin = _designed_for(design)
    whose = "the design" if design else "a design for one sample"
    if not heard.round_trips_s:
        text = f"none of {heard.asked_time} TIMESYNC was answered: the delay is not known"
        yield Finding(Verdict.MISSING, "delay", text, "let TIMESYNC through to the autopilot (a router may keep it)")
    else:
        median, p95 = (1e3 * percentile(heard.round_trips_s, share) for share in (0.5, LATE))
        samples = [1 + math.floor(1e-3 * ms * rate_hz) for ms in (median, p95)]
        text = (
            f"TIMESYNC round trip {median:.1f} ms in the median, {p95:.1f} ms at 95 %: corrections {samples[0]} and "
            f"{samples[1]} samples old; {whose} stands {delay + 1} and {delay + margin}"
        )
        good = samples[0] <= delay + 1 and samples[1] <= delay + margin
        remedy = (
            "" if good else "a link of its own at 921600 baud or UDP, fewer streams, or a design for more delay_samples"
        )
        yield Finding(Verdict.OK if good else Verdict.MISSING, "delay", text, remedy)
    known = [age for age in heard.ages if math.isfinite(age) and age >= 0.0]
    if known:
        text = f"the vehicle reports corrections {np.median(known):g} samples old in the median"
        yield Finding(Verdict.NOTE, "delay", text, "corrections were at work: is another companion flying?")
    elif heard.profile.age is AgeSource.ESTIMATED:
        yield Finding(Verdict.NOTE, "delay", f"the age of a correction is {heard.profile.age.value}")
    elif heard.ages:
        text = "the age that the vehicle reports cannot be known: doctor sends no corrections"
        yield Finding(Verdict.NOTE, "delay", text)


def _designed_for(design: DobDesign | None) -> tuple[int, int]:
    if design is None:
        return ONE_SAMPLE
    stands = min(block.delay_samples + block.certificate.delay_margin_samples for block in design.blocks)
    delay = min(block.delay_samples for block in design.blocks)
    return delay, stands - delay


def _limit(design: DobDesign | None) -> Iterator[Finding]:
    if design is None:
        return
    if design.limit is None:
        remedy = "state largest_disturbance in the spec's blocks, or set DOB_LIMIT"
        yield Finding(Verdict.NOTE, "limit", f"the design has none of its own; DOB_LIMIT is {UNKNOWN_LIMIT:g}", remedy)
    else:
        yield Finding(Verdict.OK, "limit", f"the design is for disturbances of {design.limit:g} at most: DOB_LIMIT")


def _signs(heard: Listening, design: DobDesign | None) -> Iterator[Finding]:
    if heard.correctors:
        who = ", ".join(f"{sender.system}/{sender.component}" for sender in sorted(heard.correctors, key=str))
        text = f"corrections of {who} are on the link"
        yield Finding(Verdict.MISSING, "companion", text, "one companion for each vehicle: stop the other one")
    if heard.check is None or design is None:
        yield Finding(Verdict.NOTE, "signs", "not looked at: they need a design", "add --design FILE")
        return
    errors = heard.check.errors()
    turned = heard.rotations.found() if heard.rotations else None
    if turned is not None:
        text = f"rates do not answer the moments with axes gyro = {heard.axes.gyro}"
        text += f": {', '.join(errors)}" * bool(errors)
        remedy = f"[axes] gyro = {turned.after(heard.axes.gyro)} in the configuration (--config): that fits"
        yield Finding(Verdict.MISSING, "signs", text, remedy)
        return
    for error in errors:
        remedy = "rates in rad/s, moments as normalized torque, hover axes or [axes] (docs/interfaces.md)"
        yield Finding(Verdict.MISSING, "signs", error, remedy)
    unproven = heard.check.unproven()
    if unproven and not errors:
        text = f"{', '.join(unproven)}: cannot be known from listening to a vehicle that moves too little"
        yield Finding(Verdict.NOTE, "signs", text, "doctor again in hover; `run` checks them in TRACKING too")
    elif not errors:
        yield Finding(Verdict.OK, "signs", "rates and moments of all axes belong together as the design says")


# Profile --------------------------------------------------------------------------------------------------------


def _best_profile(heard: Listening, rate_hz: float) -> str | None:
    """The profile of the autopilot's make, or asked for; one that is for any make only where its inputs are heard."""
    profile = heard.profile
    return profile.name if profile.makes or _delivers(heard, rate_hz) else None


def _delivers(heard: Listening, rate_hz: float) -> bool:
    for what, name in zip((Input.GYRO, Input.MOMENT), _inputs_of(heard), strict=True):
        stream = heard.stream(name)
        if stream is None or not stream.stamped or stream.rate_by_stamp_hz < _least_rate(heard, what) * rate_hz:
            return False
    return True


def _profile(heard: Listening, rate_hz: float) -> Iterator[Finding]:
    profile, make = heard.profile, heard.autopilot.make if heard.autopilot else ""
    if not profile.suits(make):
        text = f"{profile.name} is for {' or '.join(profile.makes)}, not for {make}: `run` would not obey it"
        yield Finding(Verdict.MISSING, "profile", text, "--profile auto")
    elif _delivers(heard, rate_hz):
        yield Finding(Verdict.OK, "profile", f"{profile.name}: `run --profile {profile.name}` has its inputs")
    else:
        name = profile.name if profile.makes else "none"
        yield Finding(Verdict.MISSING, "profile", f"{name}: inputs are missing or slow", profile.remedy)
