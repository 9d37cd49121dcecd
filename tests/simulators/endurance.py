"""Minutes in hover in noise, off and then on, on a good wire or on one that goes wrong in every way we know:

    DOB_ARDUCOPTER=… python -m tests.simulators.endurance ardupilot design.json -o DIR [--axes roll …] [--faults]
    DOB_PX4=…        python -m tests.simulators.endurance px4 design.json -o DIR [--axes roll …] [--faults]

White noise through a 1 Hz low-pass about all three axes, or those that are named. With --faults the relay loses 1 % of
all messages throughout, and a fault of the next kind begins whenever the correction is fully in. Prints tables for
docs; DIR gets result.json. Linux only, in a network of its own.
"""

import argparse
import json
import re
import time
from collections import Counter
from dataclasses import asdict, dataclass
from datetime import datetime
from itertools import cycle
from pathlib import Path

import numpy as np

from dob_companion.artifact import loads
from tests.ardupilot.flights import ACTIVE
from tests.ardupilot.namespace import go_inside
from tests.ardupilot.programs import AXES, PROGRAMS, signal
from tests.ardupilot.promised import promises
from tests.px4.attitude import log_of, windows
from tests.simulators.aircraft import AIRCRAFT, Flight, hover
from tests.simulators.judge import judge
from tests.simulators.relay import CUT, Faults

BLOCK_S, PATIENCE_S = 10.0, 20.0
LOSS = Faults(lost=0.01)
KINDS = {
    "1 % loss alone": (1.0, LOSS, LOSS),
    "burst: half of all lost": (0.2, Faults(lost=0.5), Faults(lost=0.5)),
    "a fifth comes twice": (1.0, Faults(lost=0.01, twice=0.2), Faults(lost=0.01, twice=0.2)),
    "reordered: up to 12 ms late": (1.0, Faults(lost=0.01, jitter=0.012), Faults(lost=0.01, jitter=0.012)),
    "corrupt bytes in 5 %": (1.0, Faults(lost=0.01, corrupt=0.05), Faults(lost=0.01, corrupt=0.05)),
    "4 ms late, both ways": (2.0, Faults(lost=0.01, delay=0.004), Faults(lost=0.01, delay=0.004)),
    "30 ms late, both ways": (1.0, Faults(lost=0.01, delay=0.03), Faults(lost=0.01, delay=0.03)),
    "cut, 16 ms": (0.016, CUT, CUT),
    "cut, 60 ms": (0.06, CUT, CUT),
    "cut, 1 s": (1.0, CUT, CUT),
    "vehicle to companion cut, 0.15 s": (0.15, CUT, LOSS),
    "companion to vehicle cut, 70 ms": (0.07, LOSS, CUT),
    "companion to vehicle cut, 1 s": (1.0, LOSS, CUT),
}
"""Every kind of fault: how long it lasts in s, and what happens to what the autopilot and the companion say."""


def noise(axes: list[str]) -> dict[int, np.ndarray]:
    """Angular accelerations about these axes, rad/s²; each begins elsewhere in its ten minutes."""
    found = {}
    for axis, name in [(AXES.index(name), name) for name in axes]:
        whole = signal(PROGRAMS[f"noise-{name}"], 600.0)
        found[axis] = np.roll(whole, axis * len(whole) // 3)
    return found


def one(flight: Flight, kind: str) -> float | None:
    """A fault; the time from its end until the correction is fully in: 0 when it never left, None when it is not in
    PATIENCE_S."""
    lasts, down, up = KINDS[kind]
    flight.relay.spoil(down, up)
    time.sleep(lasts)
    over = flight.relay.spoil(LOSS, LOSS)
    time.sleep(0.3)
    recovered = 0.0
    while not back(flight):
        recovered = time.monotonic() - over
        if recovered > PATIENCE_S:
            return None
        time.sleep(0.02)
    time.sleep(1.0)
    return recovered


def back(flight: Flight) -> bool:
    """Whether the companion says that it is ACTIVE, over a link that brings its telemetry."""
    told = flight.ground.telemetry
    count = len(told)
    time.sleep(0.1)
    return len(told) > count and told[-1][7] == ACTIVE


@dataclass
class Flown:
    """Attitudes off and on (rows of time s, roll, pitch, yaw rad), recoveries by kind, and when it was on."""

    off: list
    on: list
    recoveries: dict[str, list[float | None]]
    marks: dict[str, float]
    on_posix: float


def fly(flight: Flight, axes: list[str], off_s: float, minutes: float, *, faults: bool) -> Flown:
    """So many seconds off, then so many minutes on."""
    found: dict[str, list[float | None]] = {}
    with flight.companion():
        flight.take_off()
        flight.disturb(noise(axes))
        time.sleep(5.0)
        attitudes = flight.ground.attitudes
        begun = len(attitudes)
        time.sleep(off_s)
        off = attitudes[begun:]
        flight.enable()
        flight.mark("on")
        begun, on_posix, end = len(attitudes), time.time(), time.monotonic() + 60.0 * minutes
        if faults:
            flight.relay.spoil(LOSS, LOSS)
        kinds = cycle(KINDS)
        while time.monotonic() < end:
            if faults:
                kind = next(kinds)
                found.setdefault(kind, []).append(one(flight, kind))
            else:
                time.sleep(1.0)
        flight.mark("end")
        on = attitudes[begun:]
        flight.relay.spoil()
    return Flown(off, on, found, flight.marks, on_posix)


def steal() -> tuple[float, float]:
    """Time that the hypervisor has taken away, and all time, in jiffies since the start of the computer."""
    values = [float(value) for value in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
    return values[7], sum(values)


def angles(rows: list) -> np.ndarray:
    """Roll, pitch, yaw in deg about their mean."""
    whole = np.degrees(np.unwrap(np.array(rows)[:, 1:4], axis=0))
    return whole - whole.mean(axis=0)


def worst(rows: list) -> np.ndarray:
    """The largest RMS of BLOCK_S, by axis, deg."""
    times, whole = np.array(rows)[:, 0], angles(rows)
    blocks = np.floor((times - times[0]) / BLOCK_S).astype(int)
    each = [whole[blocks == block] for block in range(blocks[-1])]
    return np.array([np.sqrt(np.mean(block**2, axis=0)) for block in each]).max(axis=0)


def compare(off: list, on: list, axes: list[str]) -> list[dict]:
    """Attitudes with and without, by axis, deg."""
    found = []
    for axis, name in [(AXES.index(name), name) for name in axes]:
        one, other = angles(off)[:, axis], angles(on)[:, axis]
        found.append(
            {
                "axis": name,
                "rms off": float(one.std()),
                "rms on": float(other.std()),
                "worst 10 s off": float(worst(off)[axis]),
                "worst 10 s on": float(worst(on)[axis]),
                "peak off": float(np.abs(one).max()),
                "peak on": float(np.abs(other).max()),
            }
        )
    return found


def with_not_done(directory: Path, rows: list[dict], promised: dict[tuple[str, str], float]) -> list[dict]:
    """The rows of PX4 with the estimate less the setpoint, off and on, which is what an observer can change."""
    log, ((off, on),) = log_of(directory), zip(*windows(directory).values(), strict=True)
    without, with_ = log.parts(*off)["not done"], log.parts(*on)["not done"]
    return [
        row
        | {
            "not done off": float(without[AXES.index(row["axis"])]),
            "not done on": float(with_[AXES.index(row["axis"])]),
            "promised": promised[f"noise-{row['axis']}", row["axis"]],
        }
        for row in rows
    ]


def fades(directory: Path, began: float) -> Counter[str]:
    """Why the companion faded out while it was to be on, numbers left out. `began`: POSIX time."""
    found: Counter[str] = Counter()
    for text in (directory / "companion.jsonl").read_text().splitlines():
        said = json.loads(text) if text.startswith("{") else {}
        event = said.get("event", "")
        if event.startswith("DOB RAMP_OUT: ") and datetime.fromisoformat(said["time"]).timestamp() > began:
            found[re.sub(r"[\d.]+", "…", event.removeprefix("DOB RAMP_OUT: "))] += 1
    return found


def limit_of(directory: Path) -> float:
    """DOB_LIMIT as the companion has said it."""
    text = (directory / "companion.jsonl").read_text()
    return float(re.search(r"DOB_LIMIT ([\d.]+)", text).group(1))


def say(result: dict) -> None:
    """The tables."""
    print("| axis | RMS off | on | off/on | worst 10 s off | on | peak off | on |")
    print("| --- | --: | --: | --: | --: | --: | --: | --: |")
    for row in result["attitudes"]:
        print(
            f"| {row['axis']} | {row['rms off']:.3f}° | {row['rms on']:.3f}° | {row['rms off'] / row['rms on']:.1f} "
            f"| {row['worst 10 s off']:.3f}° | {row['worst 10 s on']:.3f}° | {row['peak off']:.2f}° "
            f"| {row['peak on']:.2f}° |"
        )
    for row in result["attitudes"]:
        if "promised" in row:
            off, on = row["not done off"], row["not done on"]
            print(f"{row['axis']}: estimate less setpoint {off:.3f}° -> {on:.3f}°, {off / on:.1f} times less")
    if result["recoveries"]:
        print("\n| what was tried | times | recovered | no fade | recovery, median s | longest s |")
        print("| --- | --: | --: | --: | --: | --: |")
    for kind, times in result["recoveries"].items():
        good = [time for time in times if time is not None]
        middle, longest = (np.median(good), max(good)) if good else (np.nan, np.nan)
        print(f"| {kind} | {len(times)} | {len(good)} | {good.count(0.0)} | {middle:.2f} | {longest:.2f} |")
    print("\nfades:", "; ".join(f"{why}: {count}" for why, count in sorted(result["fades"].items())) or "none")
    print("corrections:", ", ".join(f"{name} {value:.6g}" for name, value in result["verdict"].items()))
    print(f"corrections from bad data: {result['wrong']}; time stolen from the computer: {result['steal']:.1%}")


def main() -> None:
    """Enter the namespace, then fly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("autopilot", choices=AIRCRAFT)
    parser.add_argument("design", type=Path)
    parser.add_argument("-o", type=Path, required=True, metavar="DIR")
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--off", type=float, default=60.0, metavar="SECONDS")
    parser.add_argument("--axes", nargs="+", choices=AXES, default=list(AXES))
    parser.add_argument("--faults", action="store_true")
    arguments = parser.parse_args()
    go_inside("tests.simulators.endurance")
    aircraft, directory, design = AIRCRAFT[arguments.autopilot], arguments.o.resolve(), arguments.design.resolve()
    promised = promises(loads(design.read_text()))
    for axis in arguments.axes:
        print(f"promised: {axis} {promised[f'noise-{axis}', axis]:.1f} times less", flush=True)
    before = steal()
    with hover(aircraft, design, directory) as flight:
        flown = fly(flight, arguments.axes, arguments.off, arguments.minutes, faults=arguments.faults)
    np.savez(directory / "attitudes.npz", off=flown.off, on=flown.on)
    stolen, whole = (after - earlier for after, earlier in zip(steal(), before, strict=True))
    verdict = judge(
        aircraft, loads(design.read_text()), limit_of(directory), directory / "wire.log",
        flown.marks["on"], flown.marks["end"],
    )  # fmt: skip
    rows = compare(flown.off, flown.on, arguments.axes)
    result = {
        "attitudes": rows if aircraft.name == "ardupilot" else with_not_done(directory, rows, promised),
        "recoveries": flown.recoveries,
        "fades": fades(directory, flown.on_posix),
        "verdict": asdict(verdict),
        "wrong": verdict.wrong,
        "steal": stolen / whole,
    }
    (directory / "result.json").write_text(json.dumps(result, indent=1) + "\n")
    say(result)


if __name__ == "__main__":
    main()
