"""The observer of a tail-sitter in its transition to forward flight and back, beside ArduPlane in its simulator:

    DOB_ARDUPLANE=… python -m tests.simulators.transition design.json -o DIR

Hover with the correction in, in a sine about roll; mode LOITER, in which it flies circles on its wing; mode GUIDED, in
which it hovers again. What acts is what the script on board reports. Prints JSON; DIR gets it as result.json. Linux
only, in a network of its own.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

from tests.ardupilot.namespace import go_inside
from tests.ardupilot.programs import PROGRAMS, signal
from tests.ardupilot.tailsitter import PlaneGround
from tests.simulators.aircraft import TAILSITTER, Flight, Wire, hover, number, payload
from tests.simulators.relay import Way, passed

LOITER, EXTENDED_SYS_STATE, MULTICOPTER = 12, 245, 3
FORWARD_S = 20.0
LEFT, WING, BACK, HOVER, ACTIVE = "hover left", "on its wing", "back asked for", "in hover", "active again"


def fly(flight: Flight) -> None:
    """There and back."""
    with flight.companion():
        flight.take_off()
        ground = flight.ground
        assert isinstance(ground, PlaneGround)
        flight.disturb({0: signal(PROGRAMS["sine-roll"], 2.0)})
        flight.enable()
        time.sleep(3.0)
        flight.mark(LEFT)
        ground.set_mode("LOITER", LOITER)
        time.sleep(1.0)
        flight.disturb({0: np.zeros(1)})
        ground.wait("forward flight", lambda: ground.on_its_wing)
        flight.mark(WING)
        time.sleep(FORWARD_S)
        flight.mark(BACK)
        ground.set_mode("GUIDED", ground.guided)
        ground.wait("hover", lambda: ground.in_hover)
        flight.mark(HOVER)
        flight.wait_active()
        flight.mark(ACTIVE)
        time.sleep(3.0)


def told_of_hover(log: Path, after: float) -> float:
    """When the companion was first told that it is a multicopter again, monotonic s."""
    return next(
        p.came
        for p in passed(log)
        if p.came > after
        and p.way is Way.DOWN
        and number(p.frame) == EXTENDED_SYS_STATE
        and payload(p.frame, 2)[0] == MULTICOPTER
    )


def result(directory: Path, marks: dict[str, float], texts: list[tuple[float, int, str]]) -> dict[str, object]:
    """When it was gone, that it stayed gone, and when it was back; times in s from the command to leave hover."""
    log, began = directory / "wire.log", marks[LEFT]
    wire, told = Wire.of(TAILSITTER, log), told_of_hover(log, marks[BACK])
    before, after = wire.acting(began - 2.0, began), wire.acting(began, told)
    acting = after[np.any(after[:, 5:] != 0.0, axis=1)]
    away = wire.acting(marks[WING], told)
    return {
        "largest before": float(np.abs(before[:, 5:]).max()),
        "zero after s": float(acting[-1, 0] - began),
        "largest on its wing": float(np.abs(away[:, 5:]).max()),
        "reports on its wing": len(away),
        **{f"{name} s": marks[name] - began for name in (WING, BACK, HOVER, ACTIVE)},
        "said": [[round(at - began, 2), text] for at, _, text in texts if "DOB" in text and at > began],
    }


def main() -> None:
    """Enter the namespace, then fly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("design", type=Path)
    parser.add_argument("-o", type=Path, required=True, metavar="DIR")
    arguments = parser.parse_args()
    go_inside("tests.simulators.transition")
    directory = arguments.o.resolve()
    with hover(TAILSITTER, arguments.design.resolve(), directory) as flight:
        fly(flight)
    found = result(directory, flight.marks, flight.texts)
    (directory / "result.json").write_text(json.dumps(found, indent=1) + "\n")
    print(json.dumps(found))


if __name__ == "__main__":
    main()
