"""Prints the tables of docs/optimal.md and draws its figures: `python -m docs.optimal`, a few minutes.

With `--write` the tables are put between the marks of that page and the figures into docs/img.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from dob_companion.comparison.at_price import AtPrice
from dob_companion.comparison.flight import DISTURBANCE_HZ, NOISE_SIGMA, PEAKS_OFF, expect, make_weather
from dob_companion.comparison.vehicle import ATTITUDE_GAIN, Vehicle, close, no_observer
from dob_companion.report.palette import COLOURS
from dob_companion.synthesis import parse_spec
from dob_companion.synthesis.optimal.bound import AttenuationLimits
from dob_companion.synthesis.optimal.problem import Axis, Block, Spectrum, Wanted
from dob_companion.synthesis.optimal.search import Found, Search
from dob_companion.synthesis.plant.models import to_state_space
from dob_companion.synthesis.spec.spectrum import LowPass
from docs.shipped import shipped_table

HERE = Path(__file__).parent
SPEC = HERE.parent / "examples" / "tailsitter_tuned.toml"
DT, SEEDS = 0.004, 20

LIMITS = {"pitch": (0.400, 3.00e-4), "roll": (0.412, 1.08e-3), "yaw": (0.882, 4.11e-4)}
"""Disk margin and RMS noise in the correction that the observers compared keep."""

MARGINS = (0.2, 0.3, 0.4, 0.5, 0.6)


class Case:
    """One axis of the tail-sitter in the paper's weather."""

    def __init__(self, name: str, order: int = 6) -> None:
        spec = parse_spec(SPEC.read_text(encoding="utf-8"))
        (block,) = (block for block in spec.blocks if block.name == name)
        plant, controller = (to_state_space(model, DT, (1, 1)) for model in (block.plant, block.controller))
        self.name, self.vehicle = name, Vehicle(plant, controller, 1)
        self.rms = make_weather(self.vehicle, PEAKS_OFF[name], SEEDS).typical_scale
        axis = Axis.of(plant, controller, 1, ATTITUDE_GAIN)
        spectrum = Spectrum(LowPass(DISTURBANCE_HZ), self.rms)
        self.search = Search(axis, spectrum, order)
        self.limits = AttenuationLimits(Block(plant, controller, (1,), ATTITUDE_GAIN), spectrum, NOISE_SIGMA)
        margin, noise = LIMITS[name]
        self.wanted = Wanted(disk_margin=margin, noise=noise, noise_rms=NOISE_SIGMA, gains=())

    def attenuation(self, observer: Any) -> float:
        """By the Lyapunov equations of the closed loop."""
        off, on = (expect(close(self.vehicle, each), self.rms) for each in (no_observer(DT), observer))
        assert off is not None
        assert on is not None
        return off.attitude / on.attitude

    def best(self, wanted: Wanted) -> Found:
        """The best observer of the search's order."""
        found = self.search.best(wanted)
        assert found is not None
        return found


def reached_table() -> Iterator[str]:
    """An axis a row: what orders 4 and 6 reach, a finite F of order 64, and the bound."""
    yield "| axis | disk margin, noise RMS | order 4 | order 6 | order 64 | bound | order 6 of it |"
    yield "| --- | --- | --- | --- | --- | --- | --- |"
    for name, (margin, noise) in LIMITS.items():
        four, six = Case(name, 4), Case(name, 6)
        reached = [c.attenuation(c.best(c.wanted).observer(c.search.axis)) for c in (four, six)]
        high = six.attenuation(AtPrice(six.vehicle, six.rms).best(margin, noise))
        limit = six.limits.of(six.wanted)
        cells = [f"{value:.2f}" for value in (*reached, high, limit)]
        yield f"| {name} | {margin:.3f}, {noise:.2e} | {' | '.join(cells)} | {100.0 * reached[1] / limit:.1f} % |"


def front(case: Case) -> list[tuple[float, float, float]]:
    """(disk margin, reached, bound) along the trade-off."""
    found = []
    for margin in MARGINS:
        wanted = replace(case.wanted, disk_margin=margin)
        observer = case.best(wanted).observer(case.search.axis)
        found.append((margin, case.attenuation(observer), case.limits.of(wanted)))
    return found


def front_table(rows: list[tuple[float, float, float]]) -> Iterator[str]:
    """A disk margin a row."""
    yield "| disk margin, pitch | reached | no observer has more than | reached of that |"
    yield "| --- | --- | --- | --- |"
    for margin, reached, limit in rows:
        yield f"| {margin:.1f} | {reached:.2f} | {limit:.2f} | {100.0 * reached / limit:.1f} % |"


def front_figure(rows: list[tuple[float, float, float]], to: Path) -> None:
    """Attenuation over disk margin, reached and bound."""
    margin, reached, limit = (np.array(column) for column in zip(*rows, strict=True))
    axes, save = _axes("disk margin", "attenuation, off / on")
    axes.fill_between(margin, limit, 1.15 * limit.max(), color="#eeeeee", label="no observer is here")
    axes.plot(margin, limit, color=COLOURS["bound"], label="dual bound")
    axes.plot(margin, reached, "o-", color=COLOURS["on"], label="order 6")
    axes.set_ylim(0.0, 1.15 * limit.max())
    axes.legend(loc="lower left")
    save(to)


def responses_figure(case: Case, to: Path) -> None:
    """T_f and S T_f of the best observer, and the level that the disk margin leaves to S T_f."""
    on, found = case.search.on, case.best(case.wanted)
    hertz = on.angles / (2.0 * np.pi * on.dt)
    axes, save = _axes("frequency, Hz", "magnitude, dB")
    for name, values, role in (
        ("S, no observer", on.S, "off"),
        ("T_f: d → d − d̂ delayed", 1.0 - on.T(found.solved.F), "extra"),
        ("S T_f", on.sensitivity(found.solved.F), "on"),
    ):
        axes.semilogx(hertz, 20.0 * np.log10(np.abs(values)), color=COLOURS[role], label=name)
    level = 1.0 / case.wanted.disk_margin + 0.5  # of |S T_f| where |S T_f - 1/2| <= 1/margin
    axes.axhline(20.0 * np.log10(level), color=COLOURS["bound"], ls="--", label="most that the disk margin leaves")
    axes.set_xlim(0.05, 125.0)
    axes.set_ylim(-60.0, 15.0)
    axes.legend(loc="center left", bbox_to_anchor=(0.0, 0.68))
    save(to)


def _axes(x: str, y: str) -> tuple[Any, Any]:
    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "optimal"  # the same figure is the same file
    from matplotlib import pyplot

    picture, axes = pyplot.subplots(figsize=(6.4, 3.8), layout="constrained")
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(color="#e4e4e4", lw=0.8)
    return axes, lambda to: picture.savefig(to, metadata={"Date": None})


def main() -> None:
    """Print, and write if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="into docs/optimal.md and docs/img")
    write = parser.parse_args().write
    pitch = Case("pitch")
    rows = front(pitch)
    tables = {"front": front_table(rows), "reached": reached_table(), "shipped": shipped_table()}
    printed = {name: "\n".join(lines) for name, lines in tables.items()}
    for lines in printed.values():
        print(lines, end="\n\n", flush=True)
    if not write:
        return
    front_figure(rows, HERE / "img" / "optimal_front.svg")
    responses_figure(pitch, HERE / "img" / "optimal_responses.svg")
    page = (HERE / "optimal.md").read_text(encoding="utf-8")
    for name, lines in printed.items():
        begin, end = f"<!-- {name} -->\n", f"\n<!-- end {name} -->"
        before, after = page.split(begin)[0], page.split(end)[1]
        page = before + begin + lines + end + after
    (HERE / "optimal.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
