"""Functions of matrices on the unit circle, and their spectral factors H = Φ* Φ, Φ causal and stable with its inverse.

What matters lies near z = 1, so angles are even on a circle that an all-pass has warped:

    z = (w + a) / (1 + a w)         dθ/dφ = (1 - a^2) / (1 + 2 a cos φ + a^2)

It maps the outside of the unit circle onto itself, so what is causal and stable in one variable is so in the other, and
a mean over the circle of z is one over that of w weighted by dθ/dφ.

Angles stand half a step aside from 0: what is real in time is then a real series in cosines and sines.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

WARP = 0.9
"""a: half of the angles lie below 0.1 rad, 4 Hz at 250 Hz."""

STEPS, NEAR, SLOWER = 60, 1e-2, 0.3
"""Of Wilson's iteration, at most; once Φ* Φ is H within NEAR it converges quadratically, so a step that leaves more
than SLOWER of the difference has come to what the grid resolves."""


class Circle:
    """Functions at `count` angles, (count, …), and causal series of the same shape: real h_n of w^-n, n = 0, 1, …"""

    def __init__(self, count: int) -> None:
        phi = np.pi * (np.arange(count) + 0.5) / count
        self.angles = phi - 2.0 * np.arctan2(WARP * np.sin(phi), 1.0 + WARP * np.cos(phi))
        """θ, rad per sample, rising from 0 to pi."""
        self.density = (1.0 - WARP**2) / (1.0 + 2.0 * WARP * np.cos(phi) + WARP**2)
        """dθ/dφ, (count,), of mean 1."""

    def causal(self, values: Complex) -> Array:
        """h_n, n >= 0, of a series in both directions."""
        even = fft.dct(values.real, 2, axis=0) / len(values)  # h_n + h_-n
        odd = fft.dst(values.imag, 2, axis=0) / len(values)  # h_-n - h_n, from n = 1
        h = even / 2.0
        h[1:] -= odd[:-1] / 2.0
        return np.asarray(h)

    def values(self, h: Array) -> Complex:
        """Of the causal series."""
        cosines = fft.dct(np.concatenate([h[:1], h[1:] / 2.0]), 3, axis=0)
        sines = fft.dst(np.concatenate([h[1:] / 2.0, np.zeros_like(h[:1])]), 3, axis=0)
        return np.asarray(cosines - 1j * sines)

    def scalar_factor(self, powers: Array) -> Complex:
        """φ of |φ|^2 = power, each column for itself, by its cepstrum (A. V. Oppenheim, R. W. Schafer).

        What vanishes at z = 1, as with an integrating plant, has its zeros there taken out before the logarithm.
        """
        zero = 1.0 - np.exp(-1j * self.angles)
        orders = np.log(powers[1] / powers[0]) / (2.0 * np.log(np.abs(zero[1] / zero[0])))
        zeros = np.power.outer(zero, np.maximum(np.round(orders), 0.0))
        logs = np.log(powers / np.abs(zeros) ** 2)
        h = fft.dct(logs, 2, axis=0) / len(logs)
        h[0] /= 2.0
        return np.asarray(zeros * np.exp(self.values(h) / 2.0))

    def factor(self, H: Complex, near: float = 0.0) -> Complex:
        """Φ of Hermitian positive H (count, k, k), Φ^-* H Φ^-1 the identity within `near` or as nearly as can be.

        Newton's method on Φ* Φ = H (T. T. Wilson, "The factorization of matricial spectral densities", SIAM J. Appl.
        Math. 23(4), 1972), which converges from any Φ that is stable with its inverse; here from that of H's diagonal.
        """
        one, last = np.eye(H.shape[1]), np.inf
        phi: Complex = self.scalar_factor(np.einsum("nii->ni", H).real)[:, :, None] * one
        for _ in range(STEPS if len(one) > 1 else 0):
            ratio = ratio_of(H, phi)
            off = float(np.max(np.abs(ratio - one)))
            if not np.isfinite(off) or off < near or SLOWER * last < off < NEAR:
                break
            last, h = off, self.causal(ratio + one)
            h[0] /= 2.0
            phi = self.values(h) @ phi
        return phi


def ratio_of(H: Complex, phi: Complex) -> Complex:
    """Φ^-* H Φ^-1, the identity where Φ is H's factor."""
    inverse = np.linalg.inv(phi)
    return np.asarray(inverse.conj().swapaxes(1, 2) @ H @ inverse)
