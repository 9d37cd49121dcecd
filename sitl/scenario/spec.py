"""Scenario files: TOML to frozen dataclasses, with errors that name file, key and what was expected."""

from dataclasses import dataclass
from math import inf
from pathlib import Path

from sitl.attitude import Vector
from sitl.constants import AXES
from sitl.errors import ScenarioError
from sitl.scenario.checks import Check, read_checks
from sitl.scenario.events import Event, read_events
from sitl.scenario.tables import Table, nearest, read
from sitl.weather.gusts import Gust, Wind

AIRFRAMES = ("linear", "tailsitter")

_PACKAGED = Path(__file__).parents[1] / "scenarios"

PaperRatio = tuple[float | None, float | None, float | None]


@dataclass(frozen=True, slots=True)
class Pull:
    """A sinusoid that grows to its full size within `growth_s` from the lead's beginning: a pulled rubber band."""

    frequency_hz: float
    growth_s: float


@dataclass(frozen=True, slots=True)
class Disturbance:
    """A disturbance, and the attitude error peaks (rad) it causes with no observer.

    It is white noise through a low-pass of `bandwidth_hz`, or a `pull`. It is the paper's d, normalized torque at the
    plant's input, unless it acts as an outer `moment` on the body, Nm. `largest` is how strong it may be made for those
    peaks, in the unit of `Flight`'s scale.
    """

    bandwidth_hz: float
    peak_attitude_error: Vector
    pull: Pull | None = None
    moment: bool = False
    largest: float = inf


@dataclass(frozen=True, slots=True)
class Clock:
    """How the vehicle's clock departs from an exact one: see `imu.Stamps`."""

    grid_us: int
    jitter_us: float
    skew_ppm: float


@dataclass(frozen=True, slots=True)
class Windows:
    """Two equally long windows, observer off and on, each preceded by a lead that is left out; s.

    Before the second lead there are `settle_s` of still air, so that both segments begin from the same rest.
    """

    lead_s: float
    length_s: float
    settle_s: float


@dataclass(frozen=True, slots=True)
class Scenario:
    """What is flown. Without `windows` it hovers until stopped; a `disturbance` needs windows."""

    name: str
    title: str
    hover_altitude: float
    noise_dbw: float
    disturbance: Disturbance | None = None
    windows: Windows | None = None
    paper_ratio: PaperRatio | None = None
    airframe: str = "linear"
    clock: Clock | None = None
    wind: Wind | None = None
    events: tuple[Event, ...] = ()
    checks: tuple[Check, ...] = ()

    @property
    def lacks_body(self) -> bool:
        """Whether the disturbance acts on a body, which linear axes are not."""
        return self.airframe == "linear" and self.disturbance is not None and self.disturbance.moment

    @property
    def eventful(self) -> bool:
        """Something blows or happens."""
        return self.wind is not None or bool(self.events)


def packaged_names() -> list[str]:
    """Names of the scenarios that come with the package."""
    return sorted(path.stem for path in _PACKAGED.glob("*.toml"))


def load(name_or_path: str) -> Scenario:
    """Load a packaged scenario by name, or any by path (what ends in .toml or holds a slash is a path).

    Raises ScenarioError.
    """
    if name_or_path.endswith(".toml") or "/" in name_or_path:
        return _read(Path(name_or_path))
    names = packaged_names()
    if name_or_path not in names:
        hint = nearest(name_or_path, names) or f"known: {', '.join(names)}"
        raise ScenarioError(f"scenario {name_or_path!r} is unknown; {hint}; or give the path of a .toml file")
    return _read(_PACKAGED / f"{name_or_path}.toml")


def _read(path: Path) -> Scenario:
    return _scenario(Table(str(path), "", read(path)), path.stem)


def _scenario(top: Table, name: str) -> Scenario:
    gyro = top.table("gyro")
    disturbance, windows, ratio, wind, clock = (
        top.optional_table(key) for key in ("disturbance", "windows", "paper_ratio", "wind", "clock")
    )
    parts = _windows(windows) if windows else None
    lead_s, length_s = (parts.lead_s, parts.length_s) if parts else (0.0, 3600.0)
    scenario = Scenario(
        name=name,
        title=top.text("title"),
        hover_altitude=top.number("hover_altitude_m", 1.0, 100.0),
        noise_dbw=gyro.number("noise_dbw", -300.0, 0.0),
        disturbance=_disturbance(disturbance) if disturbance else None,
        windows=parts,
        paper_ratio=_paper_ratio(ratio) if ratio else None,
        airframe=top.choice("airframe", AIRFRAMES, "linear"),
        clock=read_clock(clock) if clock else None,
        wind=_wind(wind, lead_s, length_s) if wind else None,
        events=read_events(top.tables("event"), lead_s, length_s),
        checks=read_checks(top.tables("check"), length_s),
    )
    top.finish()
    gyro.finish()
    _refuse_halves(top.file, scenario)
    return scenario


def _refuse_halves(file: str, scenario: Scenario) -> None:
    if scenario.windows is None and (scenario.disturbance or scenario.checks):
        raise ScenarioError(f"{file}: [disturbance] and [[check]] come together with [windows]")
    if scenario.windows and scenario.disturbance is None and not scenario.eventful:
        raise ScenarioError(f"{file}: [windows] come together with a [disturbance], [wind] or an [[event]]")
    if scenario.lacks_body:
        raise ScenarioError(f'{file}: disturbance.acts_as: a moment needs a body; expected airframe = "tailsitter"')


def _disturbance(table: Table) -> Disturbance:
    pull = table.optional_table("pull")
    bandwidth_hz = 1.0 if pull else table.number("bandwidth_hz", 1e-3, 100.0)
    if pull:
        peaks = table.vector("peak_attitude_error_rad", AXES, 0.0, 1.0)
    else:
        peaks = table.table("peak_attitude_error_rad").axes(1e-4, 1.0)
    moment = table.choice("acts_as", ("torque", "moment"), "torque") == "moment"
    largest = table.number("largest_rms", 1e-6, 1e3) if table.has("largest_rms") else inf
    result = Disturbance(bandwidth_hz, peaks, _pull(pull) if pull else None, moment, largest)
    table.finish()
    return result


def _pull(table: Table) -> Pull:
    result = Pull(table.number("frequency_hz", 0.01, 50.0), table.number("growth_s", 0.0, 600.0))
    table.finish()
    return result


def read_clock(table: Table) -> Clock:
    """A table `clock`. Raises ScenarioError."""
    result = Clock(
        grid_us=table.whole("grid_us", 0, 20_000, 0),
        jitter_us=table.number("jitter_us", 0.0, 2_000.0, 0.0),
        skew_ppm=table.number("skew_ppm", -20_000.0, 20_000.0, 0.0),
    )
    table.finish()
    return result


def _windows(table: Table) -> Windows:
    result = Windows(
        lead_s=table.number("lead_s", 0.0, 600.0),
        length_s=table.number("length_s", 0.1, 3600.0),
        settle_s=table.number("settle_s", 0.0, 600.0),
    )
    table.finish()
    return result


def _paper_ratio(table: Table) -> PaperRatio:
    roll, pitch, yaw = (table.number(axis, 0.0, 1e6) if table.has(axis) else None for axis in AXES)
    table.finish()
    return roll, pitch, yaw


def _wind(table: Table, lead_s: float, length_s: float) -> Wind:
    turbulence = table.number("turbulence_m_s", 0.0, 50.0, 0.0)
    result = Wind(
        mean=table.number("mean_m_s", 0.5 if turbulence else 0.0, 30.0),
        from_deg=table.number("from_deg", -360.0, 360.0, 0.0),
        turbulence=turbulence,
        span_m=table.number("span_m", 0.1, 50.0) if turbulence else 1.0,
        gusts=tuple(_gust(gust, lead_s, length_s) for gust in table.tables("gust")),
    )
    table.finish()
    return result


def _gust(table: Table, lead_s: float, length_s: float) -> Gust:
    result = Gust(
        at_s=table.number("at_s", -lead_s, length_s),
        rise_s=table.number("rise_s", 0.01, 600.0),
        hold_s=table.number("hold_s", 0.0, 600.0, 0.0),
        peak=table.vector("peak_m_s", ("north", "east", "down"), -30.0, 30.0),
    )
    table.finish()
    return result
