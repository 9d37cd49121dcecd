"""Whether what was estimated is the aircraft, and not its controller, an echo of its output, or another axis."""

from collections.abc import Sequence

import numpy as np

from dob_companion.artifact import AXES
from dob_companion.autopilots.transfer import Transfer
from dob_companion.identification.result import Complexes, Floats
from dob_companion.identification.spectra import Level

CONTROLLER = 0.3
"""|1 + G C| of no loop that flies is this small, relative to the larger of 1 and |G C|, over half of its band."""
LATE_S = (-0.005, 0.0, 0.005, 0.01, 0.015, 0.02, 0.03)
"""Between gyro and moment, of a controller that is recognized."""
LOOK_S = 1.0
BACKWARDS = 0.5
"""Share of what an input seems to do to the output that may come before it."""
BY_CHANCE = 4.0
"""As many times what scatters from window to window is more than noise: of a second of lags noise shows about once."""
SWAPPED = 3.0
"""Another axis answers when its coherence is this many times the own one's, and at least CLEAR."""
CLEAR = 0.3
ALIKE = 0.98
"""Squared coherence of two instruments, over all windows and frequencies, that are one."""


def is_controller(frequency: Floats, value: Complexes, controllers: Sequence[Transfer]) -> bool:
    """Whether a response rate per torque is -1/C of one of these."""
    s = 1j * frequency
    for controller in controllers:
        loop = value * controller.response(frequency)
        for late in LATE_S:
            off = np.abs(1.0 + loop * np.exp(-s * late)) / np.maximum(1.0, np.abs(loop))
            if float(np.median(off)) < CONTROLLER:
                return True
    return False


def follows_output(stretches: Sequence[tuple[Floats, Floats]], dt: float) -> bool:
    """Whether an instrument answers to the output rather than moves it: then what it seems to do comes before it.
    Stretches of output and instrument, shape (n,).

    The two-sided impulse response from instrument to output of a cause has no part at negative times (C. Sims, "Money,
    income, and causality", American Economic Review 62 (1972)).
    """
    size = 4 * round(LOOK_S / dt)
    window = np.hanning(size)
    pairs = [
        tuple(np.fft.rfft(window * (x - x.mean())) for x in (output[start:][:size], instrument[start:][:size]))
        for output, instrument in stretches
        for start in range(0, len(output) - size + 1, size // 2)
    ]
    crosses = np.array([y * r.conj() for y, r in pairs])
    powers = np.array([np.abs(r) ** 2 for _, r in pairs])
    if not powers.any():
        return False
    whole, power = crosses.sum(axis=0), powers.sum(axis=0)
    near, look = max(1, round(0.05 / dt)), round(LOOK_S / dt)

    def answers(spectra: Complexes) -> tuple[float, float]:
        """What comes after the instrument and before it."""
        answer = np.fft.irfft(spectra / (power + 1e-2 * power.max()), size)
        return float(np.sum(answer[..., near:look] ** 2)), float(np.sum(answer[..., -look:-near] ** 2))

    after, before = answers(whole)
    scatter = answers(crosses - whole / np.maximum(power, 1e-300) * powers)[1]
    return before > BACKWARDS * after and before > BY_CHANCE * scatter


def moved_alike(found: Sequence[Level], axis: int) -> str:
    """The other axis whose instrument is this one's too, so that nothing tells them apart; "" where there is none."""
    for level in found:
        r = level.R[:, :, axis]
        own = float(np.sum(np.abs(r) ** 2))
        for other in {0, 1, 2} - {axis}:
            theirs = level.R[:, :, other]
            power = own * float(np.sum(np.abs(theirs) ** 2))
            if power > 0.0 and abs(np.sum(theirs * r.conj())) ** 2 > ALIKE * power:
                return AXES[other]
    return ""


def other_axis(found: Sequence[Level], axis: int) -> str:
    """Words for another axis that answers to this one's instrument; "" where it is this one that does."""
    if not found:
        return ""
    level = max(found, key=lambda one: one.R.shape[0])
    for name, output in (("gyro", level.Y), ("moment", level.U)):
        r = level.R[:, :, axis]
        cross = np.abs(level.banded(np.einsum("wbk,wb->bk", output, r.conj()))) ** 2
        power = level.banded(np.sum(np.abs(r) ** 2, axis=0))[:, None]
        own = level.banded(np.sum(np.abs(output) ** 2, axis=0))
        coherence = np.median(cross / np.maximum(own * power, 1e-300), axis=0)
        strongest = int(np.argmax(coherence))
        if strongest != axis and coherence[strongest] > max(CLEAR, SWAPPED * coherence[axis]):
            return f"what moves {AXES[axis]} shows in the {name} of {AXES[strongest]}"
    return ""
