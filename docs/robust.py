"""Prints the table of docs/robust.md: `python -m docs.robust` (about half a minute)."""

from pathlib import Path

from dob_companion.artifact import Certificate
from dob_companion.synthesis import design_from_toml

SPEC = Path(__file__).parents[1] / "examples" / "robust_pitch.toml"

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
    proof: Certificate = design_from_toml(spec_text(case, synthesis)).blocks[0].certificate
    names = ("noise_scale", "safe_factor", "unsafe_factor", "gamma_nominal", "gamma_sampled", "gamma_bound")
    cells = [_number(proof.extra.get(f"robust_{name}")) for name in names]
    cells += [_number(proof.disk_margin), _number(proof.extra["attenuation_bandwidth_hz"])]
    return f"| {case} | {synthesis} | {' | '.join(cells)} |"


def _number(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else "–"


if __name__ == "__main__":
    print("| uncertainty | synthesis | noise weight × | safe to | unstable at | γ, model | γ, sampled | γ, bound | "
          "disk margin | attenuates to, Hz |")  # fmt: skip
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for case in CASES:
        for synthesis in ("nominal", "robust"):
            print(row(case, synthesis), flush=True)
