"""The paper's pitch axis, eqs. (11) to (13), straight from its roots."""

from pathlib import Path

from dob_companion.synthesis import zpk

DT = 0.004
PLANT = zpk([-1.716], [1.0, 0.9447], 0.14131, DT)
PID = zpk([0.8343, 0.9987], [0.0, 1.0], 0.9002, DT)
W_D = zpk([-0.8997], [0.9962], 0.19908, DT)
W_N = zpk([0.9949], [-0.925], 3.7584, DT)

SPEC = Path(__file__).parents[2] / "examples" / "tailsitter_paper.toml"


def spec_text(delay=1, backoff=1.01):
    text = SPEC.read_text(encoding="utf-8")
    return text.replace("delay_samples = 1 ", f"delay_samples = {delay} ").replace("= 1.01 ", f"= {backoff} ")
