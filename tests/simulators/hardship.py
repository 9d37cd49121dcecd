"""What would hurt if it went wrong, done to the daemon beside a real autopilot in its simulator, in a disturbance:

    DOB_ARDUCOPTER=… python -m tests.simulators.hardship ardupilot design.json -o DIR
    DOB_PX4=…        python -m tests.simulators.hardship px4 design.json -o DIR

The daemon killed and started again; either direction of its link cut for two seconds; the autopilot's power lost in the
air, and on again. What acts is what the autopilot itself reports, read on its wire before any cut. Prints a table; DIR
gets result.json. Linux only, in a network of its own.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

from tests.ardupilot.namespace import go_inside
from tests.ardupilot.programs import PROGRAMS, signal
from tests.simulators.aircraft import AIRCRAFT, Aircraft, Flight, Wire, hover
from tests.simulators.relay import CUT, NONE

ON_THE_WAY_S = 0.02
"""A report that comes so soon after an event may tell of before."""

WINDOW_S, RAMP_IN_S = 0.02, 1.5
CUTS = {"vehicle to companion cut": (CUT, NONE), "companion to vehicle cut": (NONE, CUT)}
KILLED, RETURN, REBOOT = "daemon killed", "daemon started again", "autopilot lost its power"


def killed(flight: Flight) -> None:
    """Kill the daemon while it corrects; start another one, which nobody switches on for six seconds."""
    with flight.companion() as daemon:
        flight.take_off()
        flight.disturb({0: signal(PROGRAMS["sine-roll"], 2.0)})
        flight.enable()
        time.sleep(3.0)
        flight.mark(KILLED)
        daemon.kill()
        daemon.wait(10)
        time.sleep(2.0)
        flight.mark(f"{KILLED}, end")


def cut(flight: Flight, name: str) -> None:
    """Cut a direction for two seconds."""
    time.sleep(3.0)
    down, up = CUTS[name]
    flight.mark(name, flight.relay.spoil(down, up))
    time.sleep(2.0)
    flight.mark(f"{name}, end", flight.relay.spoil())
    time.sleep(1.0)
    flight.wait_active()
    flight.mark(f"{name}, active")


def fly(flight: Flight) -> None:
    """All of it in one hover; the power of the autopilot comes last."""
    killed(flight)
    flight.mark(RETURN)
    with flight.companion():
        time.sleep(6.0)
        flight.mark(f"{RETURN}, end")
        flight.enable()
        flight.mark(f"{RETURN}, active")
        for name in CUTS:
            cut(flight, name)
        time.sleep(3.0)
        flight.mark(REBOOT)
        flight.switch_off()
        time.sleep(3.0)
        flight.switch_on()
        flight.mark(f"{REBOOT}, back")
        flight.take_off()
        flight.mark(f"{REBOOT}, end")
        flight.wait_active()
        flight.mark(f"{REBOOT}, active")
        time.sleep(3.0)


def largest(rows: np.ndarray) -> float:
    """The largest correction in some reports."""
    return float(np.abs(rows[:, 5:]).max(initial=0.0))


def largest_step(rows: np.ndarray) -> float:
    """The largest change of the correction within WINDOW_S."""
    stamps, values = rows[:, 1], rows[:, 5:]
    ends = np.searchsorted(stamps, stamps + WINDOW_S, side="right") - 1
    return float(np.abs(values[ends] - values).max(initial=0.0))


def largest_rise(rows: np.ndarray) -> float:
    """By how much a correction grew at most above the smallest that it had been, any axis."""
    sizes = np.abs(rows[:, 5:])
    return float((sizes - np.minimum.accumulate(sizes, axis=0)).max(initial=0.0))


def row(wire: Wire, marks: dict[str, float], name: str) -> dict:
    """An event: how large the correction was, when it was zero, how it grew on the way there, how it came back."""
    begin, end = marks[name], marks[f"{name}, end"]
    before, after = wire.acting(begin - 2.0, begin), wire.acting(begin + ON_THE_WAY_S, end)
    heard = wire.asked[(wire.asked[:, 0] <= end) & wire.arrived & np.any(wire.asked[:, 2:] != 0.0, axis=1), 0].max()
    acting = after[np.any(after[:, 5:] != 0.0, axis=1)]
    found = {
        "what": name,
        "largest before": largest(before),
        "zero after s": float(acting[-1, 0] - heard) if len(acting) else 0.0,
        "after the event s": float(acting[-1, 0] - begin) if len(acting) else 0.0,
        "largest rise": largest_rise(after),
    }
    back = RETURN if name == KILLED else name
    if name == KILLED:
        found["acting before it is switched on"] = largest(wire.acting(marks[RETURN], marks[f"{RETURN}, end"]))
    if f"{back}, active" in marks:
        coming = wire.acting(marks[f"{back}, end"], marks[f"{back}, active"])
        found |= {"step before": largest_step(before), "step on return": largest_step(coming)}
    return found


def rebooted(wire: Wire, marks: dict[str, float]) -> dict:
    """The autopilot's power: DOB_ENABLE stays as the operator has set it, so the correction comes back in the air, in
    steps, as at the first enabling in a flight."""
    rows = wire.acting(marks[f"{REBOOT}, back"], marks[f"{REBOOT}, active"])
    first = rows[np.any(rows[:, 5:] != 0.0, axis=1), 0].min()
    return {
        "what": REBOOT,
        "largest before": largest(wire.acting(marks[REBOOT] - 2.0, marks[REBOOT])),
        "step before": largest_step(wire.acting(marks[REBOOT] - 2.0, marks[REBOOT])),
        "step on return": largest_step(rows[rows[:, 0] < first + RAMP_IN_S]),
    }


def results(aircraft: Aircraft, directory: Path, marks: dict[str, float]) -> list[dict]:
    """All rows of a flight."""
    wire = Wire.of(aircraft, directory / "wire.log")
    return [row(wire, marks, name) for name in (KILLED, *CUTS)] + [rebooted(wire, marks)]


def main() -> None:
    """Enter the namespace, then fly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("autopilot", choices=AIRCRAFT)
    parser.add_argument("design", type=Path)
    parser.add_argument("-o", type=Path, required=True, metavar="DIR")
    arguments = parser.parse_args()
    go_inside("tests.simulators.hardship")
    aircraft, directory = AIRCRAFT[arguments.autopilot], arguments.o.resolve()
    with hover(aircraft, arguments.design.resolve(), directory) as flight:
        fly(flight)
    found = results(aircraft, directory, flight.marks)
    (directory / "result.json").write_text(json.dumps(found, indent=1) + "\n")
    say(found)


def say(found: list[dict]) -> None:
    """A table for the docs."""
    columns = [key for key in dict.fromkeys(key for entry in found for key in entry) if key != "what"]
    print("|", " | ".join(["what", *columns]), "|")
    print("|", " | ".join(["---", *("--:" for _ in columns)]), "|")
    for entry in found:
        cells = [f"{entry[key]:.4f}" if key in entry else "" for key in columns]
        print("|", " | ".join([entry["what"], *cells]), "|")


if __name__ == "__main__":
    main()
