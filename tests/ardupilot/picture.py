"""Draws the attitude of flown programs, observer off and then on: of tests.ardupilot.flights or tests.px4.flights.

python -m tests.ardupilot.picture my-flight TITLE docs/img/NAME.svg [PROGRAM…]
"""

import json
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from tests.ardupilot.programs import AXES


def draw(directory: Path, title: str, path: Path, names: list[str]) -> None:
    """A row of two panels for each program, one scale in a row."""
    mpl.rcParams["svg.hashsalt"] = title
    attitudes = np.load(directory / "attitudes.npy")
    rows = [row for row in json.loads((directory / "result.json").read_text()) if row["program"] in names]
    figure = Figure(figsize=(9, 2.2 * len(rows) + 0.6), layout="constrained")
    figure.suptitle(title)
    panels = figure.subplots(len(rows), 2, sharey="row", squeeze=False)
    for row, pair in zip(rows, panels, strict=True):
        for panel, state in zip(pair, ("off", "on"), strict=True):
            begin, end = row[f"{state}_s"]
            inside = (attitudes[:, 0] >= begin) & (attitudes[:, 0] <= end)
            angle = np.degrees(np.unwrap(attitudes[inside, 1 + AXES.index(row["axis"])]))
            panel.plot(attitudes[inside, 0] - begin, angle - angle.mean(), linewidth=0.9)
            panel.set_title(f"{row['program']}, observer {state}: RMS {row[f'rms_{state}']:.3g}°", fontsize="medium")
            panel.grid(alpha=0.3)
        pair[0].set_ylabel(f"{row['axis']}, °")
    for panel in panels[-1]:
        panel.set_xlabel("s")
    figure.savefig(path, metadata={"Date": None})


if __name__ == "__main__":
    draw(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]), sys.argv[4:] or ["sine-roll"])
