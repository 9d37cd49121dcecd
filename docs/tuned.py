"""Prints what docs/tuning.md and docs/comparison.md say of the tuned examples: `python -m docs.tuned`, three minutes.

With `--write` the tables are put between the marks of those pages.
"""

import argparse
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dob_companion.artifact import DobBlock, DobDesign
from dob_companion.comparison.flight import PEAKS_OFF, attitude, expect, make_weather
from dob_companion.comparison.lqg import lqg, lqg_attitude_bound
from dob_companion.comparison.shortfall import LEAST_BACKOFF, NO_LINK, shortfall
from dob_companion.comparison.vehicle import Vehicle, close, no_observer
from dob_companion.synthesis import design_from_toml
from dob_companion.synthesis.plant.models import from_data

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "examples"
SPECS = {
    "paper's weights": "tailsitter_paper.toml",
    "tuned": "tailsitter_tuned.toml",
    "`_2`": "tailsitter_tuned_2.toml",
    "`_3`": "tailsitter_tuned_3.toml",
}
SEEDS = 20
WEIGHTS = (0.1, 0.01, 1e-4, 1e-5, 1e-6)


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One axis of a design in the paper's weather, sized by SEEDS flights of it."""

    block: DobBlock
    dt: float
    vehicle: Vehicle
    observer: Any
    scale: float

    @classmethod
    def of(cls, design: DobDesign, axis: str) -> "Case":
        """The block of that axis."""
        (block,) = (block for block in design.blocks if block.axes == (axis,))
        plant, controller = (from_data(data, design.dt) for data in (block.problem.plant, block.problem.controller))
        vehicle = Vehicle(plant, controller, block.delay_samples)
        scale = make_weather(vehicle, PEAKS_OFF[axis], SEEDS).typical_scale
        return cls(block, design.dt, vehicle, from_data(block.observer, design.dt), scale)

    @property
    def order(self) -> int:
        """States of the observer."""
        return self.block.observer.order

    def attenuation(self, vehicle: Vehicle) -> float:
        """Expected RMS attitude error off / on of a vehicle that this observer was perhaps not designed for."""
        off, on = (expect(close(vehicle, o), self.scale) for o in (no_observer(self.dt), self.observer))
        assert off is not None
        assert on is not None
        return off.attitude / on.attitude

    def peak_ratio(self) -> float:
        """Peak off / on, mean of SEEDS flights."""
        peak_off = PEAKS_OFF[self.block.axes[0]]
        weather = make_weather(self.vehicle, peak_off, SEEDS)
        theta = attitude(close(self.vehicle, self.observer), weather.d, weather.n)
        return float(np.mean(peak_off / np.max(np.abs(theta), axis=0)))

    def noise(self) -> float:
        """RMS of the correction that gyro noise alone causes, normalized torque."""
        found = expect(close(self.vehicle, self.observer), self.scale)
        assert found is not None
        return found.noise_in_correction

    def above_best(self) -> str:
        """RMS above the LQG-optimal at this price."""
        return f"{100.0 * shortfall(self.block, self.dt, self.scale).excess:.0f} %".replace("-", "−")

    def margins(self) -> str:
        """Disk margin, delay margin."""
        return f"{self.block.certificate.disk_margin:.3f}, {self.block.certificate.delay_margin_samples}"


def designs() -> dict[str, DobDesign]:
    """The paper's example and the tuned ones."""
    return {name: design_from_toml((EXAMPLES / spec).read_text("utf-8"), spec) for name, spec in SPECS.items()}


def pitch_table(found: dict[str, DobDesign]) -> Iterator[str]:
    """Pitch: a column a design."""
    cases = [Case.of(design, "pitch") for design in found.values()]

    def row(name: str, cells: list[str]) -> str:
        return f"| {name} | {' | '.join(cells)} |"

    yield f"| | {' | '.join(found)} |"
    yield "| --- " * (len(cases) + 1) + "|"
    yield row("link delay, samples", [str(case.block.delay_samples) for case in cases])
    yield row("RMS off / on expected", [f"{case.attenuation(case.vehicle):.2f}" for case in cases])
    yield row(
        "plant's gain 30 % lower, 30 % higher",
        [", ".join(f"{case.attenuation(case.vehicle.with_gain(g)):.1f}" for g in (0.7, 1.3)) for case in cases],
    )
    yield row(
        "link one sample later than designed, reported",
        [f"{case.attenuation(case.vehicle.with_delay(1)):.1f}" for case in cases],
    )
    yield row(
        f"peak off / on, mean of {SEEDS} linear flights of 60 s, pitch", [f"{case.peak_ratio():.1f}" for case in cases]
    )
    yield row("disk margin, delay margin", [case.margins() for case in cases])
    yield row(
        "n → d̂, pitch: RMS; peak",
        [
            f"{_power(case.noise())}; {_decibels(case.block.certificate.extra['noise_to_estimate_peak'])} dB"
            for case in cases
        ],
    )
    yield row("slowest mode, s; states", [f"{c.block.certificate.slowest_mode_s:.3f}; {c.order}" for c in cases])
    yield row(
        "RMS above the [LQG-optimal](comparison.md#how-far-from-lqg-optimal) at this price",
        [case.above_best() for case in cases],
    )


def others_table(found: dict[str, DobDesign]) -> Iterator[str]:
    """Roll and yaw: a row a tuned design."""
    head = ("axis, link delay", "RMS off / on", "peak off / on", "gain −30 %, +30 %", "disk margin, delay margin")
    yield f"| {' | '.join(head)} | n → d̂ RMS | above the best at this price |"
    yield "| --- | --- | --- | --- | --- | --- | --- |"
    for axis in ("roll", "yaw"):
        for design in list(found.values())[1:]:
            case = Case.of(design, axis)
            gains = ", ".join(f"{case.attenuation(case.vehicle.with_gain(g)):.1f}" for g in (0.7, 1.3))
            yield (
                f"| {axis}, {design.delay_samples} | {case.attenuation(case.vehicle):.2f} | {case.peak_ratio():.1f} "
                f"| {gains} | {case.margins()} "
                f"| {_power(case.noise())} | {case.above_best()} |"
            )


def optimum_table(found: dict[str, DobDesign]) -> Iterator[str]:
    """What single changes would bring on pitch, a column a design."""
    cases = [Case.of(design, "pitch") for design in found.values()]
    columns = [shortfall(case.block, case.dt, case.scale) for case in cases]
    steps = [{step.name: step for step in column.steps} for column in columns]

    def row(name: str, cells: Iterable[str]) -> str:
        return f"| {name} | {' | '.join(cells)} |"

    def attenuation(name: str) -> list[str]:
        return [f"{of[name].attenuation:.2f}" if name in of else "–" for of in steps]

    heads = [f"{name}, τ = {case.block.delay_samples}" for name, case in zip(found, cases, strict=True)]
    yield row("pitch", heads)
    yield "| --- " * (len(heads) + 1) + "|"
    yield row("**this design**", [f"**{of.design.attenuation:.2f}**" for of in columns])
    yield row(
        "its disk margin, delay margin, n→d̂ RMS",
        [f"{of.design.disk_margin:.3f}, {of.design.delay_margin}, {_power(of.design.noise or 0.0)}" for of in columns],
    )
    yield row("**LQG-optimal at its disk margin and noise**", [f"**{of.at_price.attenuation:.2f}**" for of in columns])
    yield row("RMS error of the design above that", [f"{100.0 * of.excess:.0f} %".replace("-", "−") for of in columns])
    yield row(f"*one thing changed:* back-off {LEAST_BACKOFF:g}", attenuation(f"back-off {LEAST_BACKOFF:g}"))
    yield row("best at its disk margin and noise, no link delay", attenuation(NO_LINK))
    loud, bold = "best with any noise", "best with any disk margin"
    yield row("best at its noise, any disk margin", attenuation(bold))
    yield row("… which leaves a disk margin of", [f"{of[bold].disk_margin:.3f}" for of in steps])
    yield row("best at its disk margin, any noise", attenuation(loud))
    yield row("… and then n→d̂ RMS", [_power(of[loud].noise or 0.0) for of in steps])
    yield row("Kalman filter told the spectrum", attenuation("Kalman filter told the spectrum"))
    yield row("**LQG bound: any noise, any margin**", [f"**{_digits(of.bound.attenuation)}**" for of in columns])
    yield row(
        "the same without link delay",
        [_digits(of["LQG bound without link delay"].attenuation) for of in steps],
    )


def bound_table(found: dict[str, DobDesign]) -> Iterator[str]:
    """The LQG-optimum of pitch by Riccati equations, as the control weight vanishes, and its infimum."""
    case = Case.of(found["paper's weights"], "pitch")
    yield f"| attenuation at a control weight of | {' | '.join(_weight(w) for w in WEIGHTS)} | infimum |"
    yield "| --- " * (len(WEIGHTS) + 2) + "|"
    calm = expect(close(case.vehicle, no_observer(case.dt)), case.scale)
    assert calm is not None
    for delay in range(4):
        vehicle = Vehicle(case.vehicle.plant, case.vehicle.controller, delay)
        costs = [lqg(vehicle, case.scale, weight).attitude for weight in WEIGHTS]
        costs.append(lqg_attitude_bound(vehicle, case.scale))
        yield f"| τ = {delay} | {' | '.join(_digits(calm.attitude / cost) for cost in costs)} |"


TABLES = {
    "tuning.md": {"pitch": pitch_table, "roll and yaw": others_table},
    "comparison.md": {"optimum": optimum_table, "bound": bound_table},
}


def mark(name: str) -> str:
    """What stands before a table in its page."""
    return f"<!-- table: python -m docs.tuned ({name}) -->"


def quoted(page: str, name: str) -> str:
    """The table as a page has it."""
    return page.partition(mark(name) + "\n")[2].partition("\n<!-- end of table -->")[0]


def _power(value: float) -> str:
    mantissa, exponent = f"{value:.2e}".split("e")
    return f"{mantissa}e−{abs(int(exponent))}"


def _decibels(gain: Any) -> str:
    return f"{20.0 * np.log10(gain):+.1f}".replace("-", "−")


def _weight(value: float) -> str:
    return f"{value:g}" if value >= 0.01 else f"1e−{round(-np.log10(value))}"


def _digits(value: float) -> str:
    return f"{value:.0f}" if value >= 1000.0 else f"{value:.1f}"


def main() -> None:
    """Print, and write when asked."""
    parser = argparse.ArgumentParser(prog="python -m docs.tuned", description=__doc__)
    parser.add_argument("--write", action="store_true", help="put the tables into their pages")
    write = parser.parse_args().write
    found = designs()
    for file, tables in TABLES.items():
        page = (HERE / file).read_text("utf-8")
        for name, table in tables.items():
            text = "\n".join(table(found))
            print(text, end="\n\n", flush=True)
            page = page.replace(f"{mark(name)}\n{quoted(page, name)}\n", f"{mark(name)}\n{text}\n")
        if write:
            (HERE / file).write_text(page, "utf-8")


if __name__ == "__main__":
    main()
