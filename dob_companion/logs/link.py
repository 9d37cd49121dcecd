"""What was heard on a link, frame by frame, read as the companion reads it: telemetry logs and our own recordings."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dob_companion.autopilots.ardupilot import QUADPLANE
from dob_companion.errors import LogError
from dob_companion.identification.record import Record
from dob_companion.logs.found import Found, Setting, records
from dob_companion.logs.series import Series
from dob_companion.mavlink import AppliedMoment, FlightState, GyroSample, Heartbeat, Input, Landed, profiles
from dob_companion.mavlink.axes import IN_HOVER, VehicleAxes
from dob_companion.mavlink.makes import ARDUPILOT, PX4
from dob_companion.mavlink.overheard import (
    Attitude,
    AttitudeAsked,
    Identity,
    Overheard,
    Overhearing,
    Parameter,
    identity_in,
)

_FILTERED = {ARDUPILOT: True, PX4: False}
"""Whether HIGHRES_IMU has passed the gyro filter that the rate controller sees (INS_GYRO_FILTER, IMU_GYRO_CUTOFF)."""


class Heard(NamedTuple):
    """A whole frame, and s of the listener's clock when it came."""

    came: float
    frame: bytes


class _Rows(NamedTuple):
    """A signal as it comes: where in the recording, its stamp in s, its values."""

    place: list[int]
    time: list[float]
    values: list[tuple[float, ...]]

    def add(self, place: int, time: float, values: tuple[float, ...]) -> None:
        self.place.append(place)
        self.time.append(time)
        self.values.append(values)

    def series(self) -> Series:
        return Series.of(self.place, self.time, self.values)


class _Collector:
    """What the vehicle said, by what it is of."""

    def __init__(self, system: int, landed: profiles.LandedRule) -> None:
        self.signals: dict[str, _Rows] = {}
        self.facts: dict[str, tuple[list[int], list[bool]]] = {}
        self.settings: list[Setting] = []
        self.read_late_us: int | None = None
        self._system, self._landed = system, landed

    def take(self, place: int, fact: Overheard) -> None:
        match fact:
            case GyroSample(stamp, rates):
                self._signal("rates", place, stamp, rates)
            case AppliedMoment(stamp, moment, thrust, correction):
                self.read_late_us = fact.read_late_us
                self._signal("moment", place, stamp, moment)
                self._signal("thrust", place, stamp, (thrust,))
                self._signal("injected", place, stamp, correction)
            case Attitude(stamp, angles):
                self._signal("attitude", place, stamp, angles)
            case AttitudeAsked(stamp, angles, rates):
                if angles is not None:
                    self._signal("attitude_setpoint", place, stamp, angles)
                if rates is not None:
                    self._signal("rate_setpoint", place, stamp, rates)
            case Parameter(name, value):
                self.settings.append((place, name, value))
            case Heartbeat() if fact.make and fact.system == self._system:
                self._fact("armed", place, fact.armed)
                self._fact("standing", place, fact.status in self._landed.standing_by)
            case FlightState() if fact.landed is not Landed.UNKNOWN:
                self._fact("flying", place, fact.landed is not Landed.ON_GROUND and not fact.forward)

    def _signal(self, name: str, place: int, stamp_us: int, values: tuple[float, ...]) -> None:
        self.signals.setdefault(name, _Rows([], [], [])).add(place, stamp_us * 1e-6, values)

    def _fact(self, name: str, place: int, holds: bool) -> None:
        places, values = self.facts.setdefault(name, ([], []))
        places.append(place)
        values.append(holds)


def records_of(
    heard: Callable[[], Iterator[Heard]], source: str, remarks: Iterable[str], axes: VehicleAxes = IN_HOVER
) -> tuple[Record, ...]:
    """The records of the vehicle whose autopilot's heartbeat comes first.

    `axes` are those in which it speaks. `heard` begins anew at each call; `remarks` are complete when it has come to
    its end. Raises LogError, one line, when no autopilot is heard or what is needed of it is missing.
    """
    identity = next(filter(None, (identity_in(frame) for _, frame in heard())), None)
    if identity is None:
        raise LogError(f"{source}: no HEARTBEAT of an autopilot in it, expected one that says whose data these are")
    profile = profiles.choose(profiles.AUTO, identity.make) or profiles.FALLBACK
    overhearing, collector = Overhearing(identity, profile, axes), _Collector(identity.system, profile.landed)
    others: Counter[int] = Counter()
    for place, (_, frame) in enumerate(heard()):
        other = identity_in(frame)
        if other is not None and other.system != identity.system:
            others[other.system] += 1
        fact = overhearing.read(frame)
        if fact is not None:
            collector.take(place, fact)
    for number, name in ((Input.GYRO, "rates"), (Input.MOMENT, "moment")):
        if name not in collector.signals:
            stream = profile.stream(number).name
            raise LogError(f"{source}: no {stream} of system {identity.system}, expected it for the {number.value}; "
                           f"needs {profile.remedy}")  # fmt: skip
    said = list(remarks)
    if others:
        said.append(f"other vehicles are heard too, left out: system {', '.join(map(str, sorted(others)))}")
    if bad := overhearing.damaged:
        said.append(f"{bad} damaged messages left out")
    found = records(_found(collector, identity, source, tuple(said)))
    late_us = collector.read_late_us
    return found if late_us is None else tuple(replace(each, moment_read_late_s=1e-6 * late_us) for each in found)


def _flying(collector: _Collector, make: str) -> None:
    """What the vehicle says of its flight; where it does not, ArduPilot's heartbeat tells: active is in the air."""
    standing = collector.facts.pop("standing", None)
    if "flying" not in collector.facts and standing is not None and make == ARDUPILOT:
        places, holds = standing
        collector.facts["flying"] = places, [not stands for stands in holds]


def _vehicle(identity: Identity, settings: Iterable[Setting]) -> str:
    """A quadplane's heartbeat is a plane's, unless its Q_MAV_TYPE says better."""
    quadplane = any(name == QUADPLANE and value for _, name, value in settings)
    return f"vtol {identity.vehicle}" if quadplane and identity.vehicle == "plane" else identity.vehicle


def _found(collector: _Collector, identity: Identity, source: str, remarks: tuple[str, ...]) -> Found:
    _flying(collector, identity.make)
    signals = {name: rows.series() for name, rows in collector.signals.items()}
    rates, moment = signals.pop("rates"), signals.pop("moment")
    return Found(
        source=source,
        make=identity.make if identity.make in _FILTERED else "",
        vehicle=_vehicle(identity, collector.settings),
        rates=rates,
        moment=moment,
        others=signals,
        facts={
            name: Series.of(places, np.full(len(places), np.nan), holds)  # these messages bear no stamp
            for name, (places, holds) in collector.facts.items()
        },
        settings=collector.settings,
        rates_filtered=_FILTERED.get(identity.make),
        remarks=remarks,
    )
