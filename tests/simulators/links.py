"""Links too thin to fly by, between the daemon and ArduCopter in its simulator:

    DOB_ARDUCOPTER=… python -m tests.simulators.links design.json -o DIR

Serial lines of 921600, 460800 and 115200 baud (two pseudo-terminals, SIM_BAUDLIMIT_EN), and UDP with seven further
groups of streams at 50 Hz. In hover, DOB_ENABLE is written, and HOVER_S later it is said what became of it. Linux only,
in a network of its own.
"""

import argparse
import contextlib
import json
import os
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tests.ardupilot.namespace import go_inside
from tests.ardupilot.simulator import Ground, companion, copter
from tests.simulators.line import line

HOVER_S = 25.0
GROUPS = ("RAW_SENS", "EXT_STAT", "RC_CHAN", "RAW_CTRL", "POSITION", "EXTRA1", "EXTRA2")
BAUD = {"SIM_BAUDLIMIT_EN": 1, "SERIAL0_BAUD": 921}
UDP = "udpclient:127.0.0.1:14540"
LINKS: dict[str, tuple[dict[str, float], int]] = {
    "serial, 921600 baud": (BAUD | {"SERIAL1_BAUD": 921}, 921600),
    "serial, 460800 baud": (BAUD | {"SERIAL1_BAUD": 460}, 460800),
    "serial, 115200 baud": (BAUD | {"SERIAL1_BAUD": 115}, 115200),
    "UDP, seven groups of streams": ({f"SR1_{group}": 50 for group in GROUPS}, 0),
}
"""Parameters, and the speed of the serial line; 0: UDP."""


@contextlib.contextmanager
def ends(baud: int) -> Iterator[tuple[str, str]]:
    """What the autopilot's port is called, and the companion's link."""
    if not baud:
        yield UDP, "udpin:127.0.0.1:14540"
        return
    with line() as (autopilot, companion_end):
        yield f"uart:{autopilot}:{baud}", f"serial:{companion_end}:{baud}"


def fly(name: str, design: Path, directory: Path) -> dict:
    """One link: the states that it was in, the worst of its numbers, the reasons that were said."""
    parameters, baud = LINKS[name]
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "companion.jsonl").unlink(missing_ok=True)
    program = Path(os.environ["DOB_ARDUCOPTER"])
    with ends(baud) as (port, link), copter(program, directory, port, **parameters):
        ground = Ground(directory / "ground.tlog")
        try:
            with companion(design, directory, link=link):
                ground.fly()
                time.sleep(5.0)
                begun = time.time()
                ground.write("DOB_ENABLE", 1.0, component=191)
                time.sleep(1.0)
                ground.write("DOB_ENABLE", 1.0, component=191)
                time.sleep(HOVER_S)
        finally:
            ground.close()
    return summary(name, directory, begun)


def summary(name: str, directory: Path, begun: float) -> dict:
    """What the companion's log says after `begun`, POSIX time."""
    lines = [json.loads(text) for text in (directory / "companion.jsonl").read_text().splitlines() if text[:1] == "{"]
    stamp = f"{time.strftime('%Y-%m-%dT%H:%M:%S', time.gmtime(begun))}"
    late = [line for line in lines if line["time"] >= stamp]
    told = [line["status"] for line in late if "status" in line]
    states = Counter(status["state"] for status in told)
    trips = sorted(status["round_trip_s"] for status in told if status["round_trip_s"] is not None)
    rates = sorted(status["rate_hz"] for status in told)
    return {
        "link": name,
        "gyro Hz": rates[len(rates) // 2],
        "round trip ms": 1e3 * trips[len(trips) // 2] if trips else None,
        "active": states["ACTIVE"] / max(1, len(told)),
        "why": Counter(status["why"] for status in told if status["why"]).most_common(2),
        "said": [line["event"] for line in late if line.get("event", "").startswith("DOB")],
    }


def main() -> None:
    """Enter the namespace, then fly each link."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("design", type=Path)
    parser.add_argument("-o", type=Path, required=True, metavar="DIR")
    parser.add_argument("link", nargs="*", metavar="LINK", help=", ".join(LINKS))
    arguments = parser.parse_intermixed_args()
    go_inside("tests.simulators.links")
    directory, found = arguments.o.resolve(), []
    print("| link | gyro | round trip | time in ACTIVE | reasons |")
    print("| --- | --: | --: | --: | --- |")
    for number, name in enumerate(arguments.link or LINKS):
        row = fly(name, arguments.design.resolve(), directory / str(number))
        found.append(row)
        trip = "–" if row["round trip ms"] is None else f"{row['round trip ms']:.3g} ms"
        reasons = "; ".join(dict.fromkeys([why for why, _ in row["why"]] + row["said"]))
        print(f"| {name} | {row['gyro Hz']:.0f} Hz | {trip} | {row['active']:.0%} | {reasons} |", flush=True)
    (directory / "result.json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
