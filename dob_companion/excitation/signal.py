"""What moves the aircraft: a multisine of low crest factor, or a logarithmic chirp, one value a sample. Pure.

A multisine's phases are drawn at random, anew for each realization, so that what a mildly nonlinear aircraft adds
differs between them (Pintelon and Schoukens, *System Identification: A Frequency Domain Approach*, 2nd ed., Wiley/IEEE
2012), and then moved until its peaks are low: the signal is clipped again and again and only the phases of what is
left are kept (van der Ouderaa, Schoukens and Renneboog, *Peak factor minimization of input and output signals of
linear systems*, IEEE Trans. Instrum. Meas. 37, 1988). A given peak then carries the most power.

Amplitudes fall with frequency: as in a logarithmic chirp each octave has its share, and there is more of low
frequencies, which the autopilot's feedback removes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dob_companion.errors import InputError

Floats = NDArray[np.float64]

MULTISINE, CHIRP = "multisine", "chirp"
KINDS = (MULTISINE, CHIRP)

REALIZATION_S = 10.0
"""A multisine is drawn anew about so often."""

BLEND_S = 0.4
"""One realization passes into the next within so long, so that nothing steps."""

CORNER_HZ, BOOST = 1.3, 3.0
"""Lines well below the corner have 1 + BOOST times the amplitude that their share of an octave gives them."""

CLIPPINGS, CLIPPED_AT = 60, 0.85
"""Rounds of clipping, and the share of the peak at which it is clipped: crest factors of about 1.4."""

HIGHEST_SHARE = 0.4
"""Highest frequency, as a share of the sample rate, that a held sample still carries."""

HIGH_HZ = 100.0
"""That of 250 Hz. What was not measured up there a robust design must take for uncertain, and pays for it further down:
40 Hz cost the simulated tail-sitter's yaw a tenth of its attenuation, and hid a mode of pitch at 72 Hz."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Excitation:
    """A signal's parameters.

    kind     "multisine" or "chirp"
    low_hz   lowest frequency; of a multisine the first line at or above it, lines lying 1/realization apart
    high_hz  highest frequency
    seconds  length of the whole, fades included
    seed     of the phases; each axis draws others
    """

    kind: str = MULTISINE
    low_hz: float = 0.3
    high_hz: float = HIGH_HZ
    seconds: float = 30.0
    seed: int = 1

    def check(self, dt: float) -> None:
        """Raises InputError, one line, for a signal that cannot be made at a sample time of `dt`, s."""
        if self.kind not in KINDS:
            raise InputError(f"signal {self.kind!r}: expected {' or '.join(KINDS)}")
        if not 2.0 <= self.seconds <= 600.0:
            raise InputError(f"seconds {self.seconds:g}: expected 2 to 600 for each axis")
        highest, lowest = HIGHEST_SHARE / dt, 1.0 / self.period_s
        if not lowest <= self.low_hz < self.high_hz <= highest:
            raise InputError(
                f"band {self.low_hz:g} to {self.high_hz:g} Hz: expected {lowest:.2g} Hz at least "
                f"(one period in {self.period_s:.3g} s), a rising pair, and {highest:g} Hz at most"
            )

    @property
    def realizations(self) -> int:
        """How often the phases of a multisine are drawn; a chirp is one."""
        return max(1, round(self.seconds / REALIZATION_S)) if self.kind == MULTISINE else 1

    @property
    def period_s(self) -> float:
        """Length of one realization."""
        return self.seconds / self.realizations


def table(signal: Excitation, amplitude: float, dt: float, axis: int) -> Floats:
    """The signal of an axis (0 roll, 1 pitch, 2 yaw), one value a sample of `dt` s, normalized torque.

    The largest of abs(values) is exactly `amplitude`. The same arguments give the same values.
    """
    values = _chirp(signal, dt) if signal.kind == CHIRP else _multisines(signal, dt, axis)
    scaled: Floats = values / np.max(np.abs(values)) * amplitude
    return scaled


def _chirp(signal: Excitation, dt: float) -> Floats:
    time, octaves = np.arange(round(signal.seconds / dt)) * dt, np.log(signal.high_hz / signal.low_hz)
    turns = signal.low_hz * signal.seconds / octaves * np.expm1(octaves * time / signal.seconds)
    swept: Floats = np.sin(2.0 * np.pi * turns)
    return swept


def _multisines(signal: Excitation, dt: float, axis: int) -> Floats:
    rng = np.random.default_rng([signal.seed, axis])
    size, blend = round(signal.period_s / dt), round(BLEND_S / dt)
    weight = np.arange(1, blend + 1) / (blend + 1)
    pieces: list[Floats] = []
    before = None
    for _ in range(signal.realizations):
        now = _multisine(signal, size, dt, rng)
        piece = now.copy()
        if before is not None:  # which goes on as it began: it is periodic
            piece[:blend] = weight * now[:blend] + (1.0 - weight) * before[:blend]
        pieces.append(piece)
        before = now
    return np.concatenate(pieces)


def _multisine(signal: Excitation, size: int, dt: float, rng: np.random.Generator) -> Floats:
    """One period of low crest factor; its peak is 1."""
    step = 1.0 / (size * dt)
    lines = np.arange(int(np.ceil(signal.low_hz / step - 1e-9)), int(signal.high_hz / step + 1e-9) + 1)
    hertz = lines * step
    amplitudes = (1.0 + BOOST / (1.0 + (hertz / CORNER_HZ) ** 2)) / np.sqrt(hertz)
    spectrum = np.zeros(size // 2 + 1, complex)
    spectrum[lines] = amplitudes * np.exp(2j * np.pi * rng.random(len(lines)))
    best: Floats = np.fft.irfft(spectrum, size)
    values = best
    for _ in range(CLIPPINGS):
        top = CLIPPED_AT * np.max(np.abs(values))
        phases = np.angle(np.fft.rfft(np.clip(values, -top, top))[lines])
        spectrum[lines] = amplitudes * np.exp(1j * phases)
        values = np.fft.irfft(spectrum, size)
        if np.max(np.abs(values)) < np.max(np.abs(best)):  # the power stays what it was
            best = values
    unit: Floats = best / np.max(np.abs(best))
    return unit
