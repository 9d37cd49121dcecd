"""Prints the table of docs/robust.md: `python -m docs.robust` (about half a minute)."""

from dataclasses import replace
from pathlib import Path

from dob_companion.artifact import DobBlock
from dob_companion.comparison.flight import PEAKS_OFF, expect, make_weather
from dob_companion.comparison.vehicle import Vehicle, close, no_observer
from dob_companion.synthesis import design_from_toml
from dob_companion.synthesis.plant.models import from_data
from dob_companion.synthesis.robust.analysis import SEED
from dob_companion.synthesis.robust.cells import factor_system, samples
from dob_companion.synthesis.spec.uncertainty import parse_uncertainty
from dob_companion.toml import Table

SPEC = Path(__file__).parents[1] / "examples" / "robust_pitch.toml"

DT = 0.004

CASES = {
    "gain ±30 %": "gain = [0.7, 1.3]",
    "gain ±30 %, pole 0.93…0.96": "gain = [0.7, 1.3]\npole = { nominal = 0.9447, range = [0.93, 0.96] }",
    "the same and 0…1 sample of delay (the example)": "",
    "10 % to 10 Hz, rising to 60 % at 50 Hz": "frequency_hz = [0, 10, 50]\nmultiplicative = [0.1, 0.1, 0.6]",
    "gain ±20 % and 5 % to 10 Hz, rising to 30 % at 50 Hz": (
        "gain = [0.8, 1.2]\nfrequency_hz = [0, 10, 50]\nmultiplicative = [0.05, 0.05, 0.3]"
    ),
}


def spec_text(case: str, synthesis: str) -> str:
    """The example with another uncertainty."""
    text = SPEC.read_text(encoding="utf-8")
    if CASES[case]:
        text = text[: text.index("gain = [0.7")] + CASES[case] + "\n"
    return text.replace('synthesis = "robust"', f'synthesis = "{synthesis}"')


def row(case: str, synthesis: str) -> str:
    """One line of the table."""
    block = design_from_toml(spec_text(case, synthesis)).blocks[0]
    proof = block.certificate
    cells = [_number(proof.extra.get(f"robust_{name}")) for name in ("safe_factor", "unsafe_factor")]
    cells += [_number(value) for value in attenuations(block)]
    cells += [_number(proof.disk_margin), _number(proof.extra["attenuation_bandwidth_hz"])]
    return f"| {case} | {synthesis} | {' | '.join(cells)} |"


def attenuations(block: DobBlock) -> tuple[float, float | None]:
    """RMS attitude error off / on in the paper's weather: of the model, and the least of the sampled plants."""
    observer, asked = from_data(block.observer, DT), block.problem
    plant, controller = from_data(asked.plant, DT), from_data(asked.controller, DT)
    uncertainty = parse_uncertainty(Table("uncertainty", block.certificate.extra["robust_uncertainty"]), block.axes)
    model = Vehicle(plant, controller, block.delay_samples)
    rms = make_weather(model, PEAKS_OFF[block.name], seeds=20).typical_scale
    found: list[float] = []
    for sample in samples(uncertainty, 20, SEED):
        true = replace(model, plant=plant * factor_system(uncertainty, sample, DT))
        off, on = (expect(close(true, each), rms) for each in (no_observer(DT), observer))
        if off is None or on is None:  # unstable
            return found[0], None
        found.append(off.attitude / on.attitude)
    return found[0], min(found)


def _number(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else "–"


if __name__ == "__main__":
    print("| uncertainty | synthesis | safe to | unstable at | attenuation, model | attenuation, worst sampled | "
          "disk margin | attenuates to, Hz |")  # fmt: skip
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for case in CASES:
        for synthesis in ("nominal", "robust"):
            print(row(case, synthesis), flush=True)
