"""The example for steady moments, and what an observer makes of them:

    python -m tests.px4.steady > steady.toml
    python -m tests.px4.steady DESIGN.json…

The first is examples/px4_sih.toml with a disturbance that wanders below 0.3 Hz as well, since what is best in noise
through a low-pass leaves the rest of a steady moment to the controllers' integrators. The second prints how much of a
steady moment each design estimates, and its attenuation in the example's own weather.
"""

import argparse
import re
from pathlib import Path

import numpy as np

from dob_companion.artifact import DobBlock, loads
from dob_companion.synthesis import parse_spec
from dob_companion.synthesis.design import problem_of
from dob_companion.synthesis.optimal.asked import spectrum_of
from dob_companion.synthesis.optimal.reached import attenuation
from dob_companion.synthesis.plant.models import from_data

EXAMPLE = Path(__file__).parents[2] / "examples" / "px4_sih.toml"
WANDERS_HZ = 0.3
HZ = (0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0, 100.0)


def steady_spec(text: str) -> str:
    """The spec for noise through a 1 Hz low-pass that grows with 1/f² in amplitude below WANDERS_HZ."""
    power = ", ".join(f"{(1.0 + (WANDERS_HZ / hz) ** 4) / (1.0 + hz**2):.4g}" for hz in HZ)
    spectrum = f"disturbance_spectrum = {{ hz = [{', '.join(map(str, HZ))}], power = [{power}] }}"
    text, count = re.subn(r"^disturbance_corner_hz = 1\.0.*$", spectrum, text, flags=re.MULTILINE)
    if count != 1:
        raise ValueError("the spec states no disturbance_corner_hz = 1.0")
    return re.sub(r"^disturbance_rms = .*\n", "", text, flags=re.MULTILINE)  # that of the other weather


def gain_at_rest(block: DobBlock) -> float:
    """How much of a steady moment u_e, at rest, the observer of one axis estimates."""
    a, b, c, d = (np.asarray(getattr(block.observer, name)) for name in "ABCD")
    return -float((c @ np.linalg.solve(np.eye(len(a)) - a, b) + d)[0, 1])


def main() -> None:
    """Print the spec, or a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("design", nargs="*", type=Path)
    designs = parser.parse_args().design
    if not designs:
        print(steady_spec(EXAMPLE.read_text(encoding="utf-8")), end="")
    asked = {block.name: block.auto for block in parse_spec(EXAMPLE.read_text(encoding="utf-8")).blocks}
    for design in (loads(path.read_text()) for path in designs):
        for block in design.blocks:
            auto = asked[block.name]
            assert auto is not None
            problem, observer = problem_of(block, design.dt), from_data(block.observer, design.dt)
            worth = attenuation(problem, observer, auto, spectrum_of(auto))
            print(f"{block.name}: at rest {gain_at_rest(block):.2%}, attenuation {worth:.2f}")


if __name__ == "__main__":
    main()
