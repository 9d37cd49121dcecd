"""Transfer functions of s, and the filters that autopilots are made of."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Coefficients = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Transfer:
    """num / den, coefficients in descending powers of s (rad/s)."""

    num: Coefficients
    den: Coefficients

    def __mul__(self, other: "Transfer") -> "Transfer":
        return Transfer(_product(self.num, other.num), _product(self.den, other.den))

    def __add__(self, other: "Transfer") -> "Transfer":
        left, right = _product(self.num, other.den), _product(other.num, self.den)
        return Transfer(tuple(map(float, np.polyadd(left, right))), _product(self.den, other.den))

    @property
    def monic(self) -> "Transfer":
        """The same with a leading coefficient of 1 in den."""
        lead = self.den[0]
        return Transfer(tuple(b / lead for b in self.num), tuple(a / lead for a in self.den))

    def at(self, hz: float) -> complex:
        """Its value at a frequency."""
        return complex(self.response(np.array(2.0 * math.pi * hz)))

    def response(self, frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Its values at frequencies, rad/s, of any shape."""
        s = 1j * frequency
        return np.asarray(np.polyval(self.num, s) / np.polyval(self.den, s))


def constant(gain: float) -> Transfer:
    """A gain."""
    return Transfer((gain,), (1.0,))


NOTHING = constant(1.0)
"""What filters nothing."""


def low_pass(hz: float) -> Transfer:
    """1 / (1 + s/w); 0 Hz stands for no filter."""
    return Transfer((1.0,), (1.0 / (2.0 * math.pi * hz), 1.0)) if hz else NOTHING


def looped_low_pass(hz: float, loop_hz: float) -> Transfer:
    """A low-pass as an autopilot's loop of period T runs it: y += a (x - y), a = T / (T + 1/w).

    Its pole 1 - a is exp(-T/tau) for tau = T / ln(1 + T w), and it is 1/w late at low frequency: a lead of tau - 1/w
    stands against tau. 0 Hz stands for no filter.
    """
    if not hz:
        return NOTHING
    late, tau = 1.0 / (2.0 * math.pi * hz), _time_constant(hz, loop_hz)
    return Transfer((tau - late, 1.0), (tau, 1.0))


def butterworth(hz: float) -> Transfer:
    """1 / (1 + sqrt(2) s/w + s²/w²), which autopilots run by the bilinear transform, exact at its corner; 0 Hz
    stands for no filter."""
    if not hz:
        return NOTHING
    w = 2.0 * math.pi * hz
    return Transfer((1.0,), (1.0 / w**2, math.sqrt(2.0) / w, 1.0))


def notch(hz: float, quality: float, left: float = 0.0) -> Transfer:
    """(1 + left s/(Q w) + s²/w²) / (1 + s/(Q w) + s²/w²): `left` of the amplitude is left at `hz`."""
    w = 2.0 * math.pi * hz
    return Transfer((1.0 / w**2, left / (quality * w), 1.0), (1.0 / w**2, 1.0 / (quality * w), 1.0))


def pid(p: float, i: float, d: float, derivative: Transfer) -> Transfer:
    """P + I/s + D times a filtered derivative; parts whose gain is 0 add no pole."""
    whole = constant(p)
    if i:
        whole += Transfer((i,), (1.0, 0.0))
    if d:
        whole += constant(d) * derivative
    return whole


def looped_derivative(hz: float, loop_hz: float) -> Transfer:
    """s behind a low-pass, as an autopilot's loop runs it. A difference over one loop is half of it late, which takes
    away the lead of `looped_low_pass` and is all that is left without a filter."""
    tau = _time_constant(hz, loop_hz) if hz else 0.5 / loop_hz
    return Transfer((1.0, 0.0), (tau, 1.0))


def _time_constant(hz: float, loop_hz: float) -> float:
    return 1.0 / (loop_hz * math.log1p(2.0 * math.pi * hz / loop_hz))


def _product(a: Coefficients, b: Coefficients) -> Coefficients:
    return tuple(map(float, np.polymul(a, b)))
