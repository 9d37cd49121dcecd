"""From a log to a model, a spec and a page: what `identify` and `tune` share."""

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from dob_companion import __version__
from dob_companion.autopilots import Parameters, Sourced, parse_parameters
from dob_companion.cli.daemon import configured
from dob_companion.cli.excite import excite
from dob_companion.cli.excited import Excited, beside, link_delay
from dob_companion.cli.exciting import RESULT as RESULT_OF_EXCITING
from dob_companion.cli.exciting import TLOG
from dob_companion.cli.identification_options import Options
from dob_companion.errors import InputError
from dob_companion.files import read_text, write_files
from dob_companion.identification.controllers import Controllers, by_parameters, of_spec
from dob_companion.identification.identify import identify
from dob_companion.identification.record import Record
from dob_companion.identification.result import Identification, Interval
from dob_companion.identification.spec import spec_text
from dob_companion.identification.surroundings import Surroundings, around
from dob_companion.logs import read_log
from dob_companion.mavlink.axes import IN_HOVER, VehicleAxes, axis_map
from dob_companion.report.identification_page import identification_page

SPEC, PAGE, RESULT = "spec.toml", "identification.html", "identification.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What came of a log. `spec` is None where none could be written, and `why` says so in one line. `make` is that of
    the autopilot, "" where it is not known."""

    found: Identification
    make: str
    surroundings: dict[str, Surroundings | None]
    spec: str | None
    why: str = ""

    def to_object(self) -> dict[str, Any]:
        """As `identify --json` prints it."""
        whole: dict[str, Any] = self.found.to_object()
        for axis, seen in self.surroundings.items():
            whole["axes"][axis]["surroundings"] = _seen(seen) if seen else None
        return whole | {
            "source": self.found.source,
            "make": self.make,
            "rate_hz": self.found.rate_hz,
            "remarks": list(self.found.remarks),
            "spec": SPEC if self.spec else None,
            "why_no_spec": self.why,
        }

    def write(self, folder: Path) -> list[Path]:
        """The page and the numbers, and the spec where there is one. Returns what was written."""
        files = {RESULT: json.dumps(self.to_object(), indent=1, allow_nan=False) + "\n"}
        if self.spec is not None:
            files[SPEC] = self.spec
        page = identification_page(self.found, self.surroundings, f"dob-companion {__version__}", tuple(sorted(files)))
        write_files(folder, {PAGE: page, **files})
        return [folder / name for name in sorted((PAGE, *files))]


def logs_of(args: argparse.Namespace, folder: Path) -> tuple[int, list[Path]]:
    """The logs that were given, or that of exciting the aircraft on a link; with the exit code of that."""
    if args.log is not None:
        return 0, args.log
    place = folder / "excitation"
    return excite(args, place, as_json=False), [place / TLOG]


def read_in_hover(path: Path, config: Path | None) -> tuple[Record, ...]:
    """The records of a log, in hover axes: the vehicle of a telemetry log speaks in those of `config`, or in those that
    `excite` wrote beside it. Raises InputError, one line."""
    said = path.parent / RESULT_OF_EXCITING
    if config is not None:
        axes = configured(config, None, None)[0].axes
    else:
        axes = _axes_in(said) if said.exists() else IN_HOVER
    return read_log(path, axes)


def _axes_in(path: Path) -> VehicleAxes:
    try:
        given = json.loads(read_text(path)).get("vehicle_axes", {})
        return VehicleAxes(**{key: axis_map(names) for key, names in given.items()})
    except (ValueError, TypeError, AttributeError) as problem:
        raise InputError(f"{path}: expected what `dob-companion excite` writes: vehicle_axes: {problem}") from None


def of_logs(paths: Sequence[Path], options: Options, config: Path | None = None) -> Outcome:
    """Read, identify, write the spec's text. Several are flights of one aircraft, the newest last: its parameters hold.
    `config` says in which axes the vehicle of a telemetry log speaks.

    Raises InputError for a log or an option that is no good.
    """
    if len({path.resolve() for path in paths}) < len(paths):
        raise InputError(f"--log {paths[-1]}: given twice, expected different flights")
    excited = [beside(path) for path in paths]
    records = [_chosen(read_in_hover(path, config), said, options) for path, said in zip(paths, excited, strict=True)]
    found = identify(records, axes=options.axes, rate_hz=options.rate_hz)
    surroundings = around(records, found)
    outcome = partial(Outcome, found=found, make=records[-1].make, surroundings=surroundings)
    if not found.usable:
        why = f"no axis is usable: {'; '.join(_reasons(found))}"
        return outcome(spec=None, why=why)
    if wrong := [axis for axis, result in found.axes.items() if result.mistaken]:
        why = f"signals of {', '.join(wrong)} are mistaken for others, so who knows of the rest; --axis takes one alone"
        return outcome(spec=None, why=why)
    try:
        controllers = _controllers(records[-1], found.usable, options)
        delays = [said.delay for said in excited if said is not None and said.delay is not None]
        late = link_delay(options.delay, max(delays, key=lambda each: each.value, default=None), controllers)
        text = spec_text(found, controllers, surroundings, late, options.rate_hz, _read_hz(records))
    except InputError as problem:
        return outcome(spec=None, why=str(problem))
    return outcome(spec=text)


def _read_hz(records: Sequence[Record]) -> Sourced | None:
    """How often the applied moment is read, by the record in which that was least often."""
    read = [hz for record in records if (hz := record.moment_read_hz) is not None]
    return Sourced(min(read), "measured: so often the script reads what acts") if read else None


def table(outcome: Outcome) -> str:
    """What a person wants to see: one line an axis, then why."""
    head = ("axis", "rad/s² per unit", "slow pole, rad/s", "lag, ms", "delay, ms", "usable")
    rows: list[tuple[str, ...]] = [head]
    for result in outcome.found.axes.values():
        model = result.model
        numbers = ["–"] * 4
        if model is not None:
            numbers = [
                _said(model.acceleration_per_unit),
                _said(model.slow_pole_rad_s),
                _said(model.lag_s, 1e3),
                _said(model.delay_s, 1e3),
            ]
        rows.append((result.axis, *numbers, "yes" if result.usable else "no"))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    missing = ["", f"no spec: {outcome.why}"] if outcome.spec is None and outcome.found.usable else []
    return "\n".join([*lines, "", *_reasons(outcome.found), *missing])


def _reasons(found: Identification) -> list[str]:
    """What is said of each axis, of several at once where it is the same."""
    said: dict[str, list[str]] = {}
    for axis, result in found.axes.items():
        said.setdefault(result.why, []).append(axis)
    return [f"{', '.join(axes)}: {why}" for why, axes in said.items()]


def longest(records: Sequence[Record]) -> Record:
    """The longest of a log's parts; it says so where there are several."""
    spans = [float(record.rates.time[-1]) for record in records]
    which = spans.index(max(spans))
    if len(records) == 1:
        return records[0]
    taken = f"part {which + 1} of {len(records)} is taken, the longest"
    return replace(records[which], remarks=(*records[which].remarks, taken))


def _chosen(records: Sequence[Record], excited: Excited | None, options: Options) -> Record:
    """The longest of a log's parts, with what is known of the autopilot from elsewhere."""
    record = longest(records)
    if options.parameters is not None:
        given = parse_parameters(read_text(options.parameters), str(options.parameters))
        return replace(record, parameters=dict(given.values))
    return record if record.parameters or excited is None else replace(record, parameters=excited.parameters)


def _controllers(record: Record, axes: tuple[str, ...], options: Options) -> Controllers:
    if options.controller is not None:
        return of_spec(read_text(options.controller), str(options.controller), axes)
    if not record.parameters:
        raise InputError(
            f"{record.source}: no parameters of the autopilot in it, which its rate controllers follow from: give "
            "--params FILE, or --controller SPEC.toml"
        )
    return by_parameters(Parameters(record.source, record.parameters), axes)


def _seen(seen: Surroundings) -> dict[str, Any]:
    return {
        "noise_rms": seen.noise_rms.to_object(),
        "disturbance_rms": seen.disturbance_rms.to_object(),
        "disturbance_corner_hz": seen.corner_hz.to_object(),
    }


def _said(interval: Interval, scale: float = 1.0) -> str:
    value, low, high = (f"{scale * x:.3g}" for x in (interval.value, interval.low, interval.high))
    return value if low == high else f"{value} ({low}…{high})"
