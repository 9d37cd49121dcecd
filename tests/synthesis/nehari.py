"""Which levels one stable axis can reach, by Nehari's theorem, on a frequency grid: no state space, no matrix equation.

With F stable, || [W_d - z^-tau F G W_d, z^-tau F W_n] || at each frequency is |alpha - z^-tau F V|^2 + beta^2, V the
spectral factor of |G W_d|^2 + |W_n|^2, alpha = W_d conj(G W_d / V), beta = |W_d W_n / V|. A level gamma is reached when
z^tau alpha / Phi, Phi the spectral factor of gamma^2 - beta^2, lies within 1 of a stable function: when the Hankel
matrix of its anticausal coefficients has norm at most 1 (B. Francis, "A Course in H-infinity Control Theory", 1987).

Where gamma_star is the largest beta, gamma^2 - beta^2 all but touches zero at levels close above it, and its factor
has ever sharper corners: a level 1e-5 away takes a grid ten times finer than the poles alone would ask for.
"""

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

POINTS, SIZE = 2**18, 2**14


class Nehari:
    """G, W_d and W_n are functions of z, stable."""

    def __init__(self, G, W_d, W_n, delay):
        z = np.exp(2j * np.pi * np.arange(POINTS) / POINTS)
        G, W_d, W_n = G(z), W_d(z), W_n(z)
        V = factor(np.abs(G * W_d) ** 2 + np.abs(W_n) ** 2)
        self.alpha, self.beta = z**delay * W_d * np.conj(G * W_d / V), np.abs(W_d * W_n / V)
        self.least = float(np.max(self.beta))

    def is_reached(self, level):
        """Whether some observer has a norm of at most `level`."""
        return level > self.least and hankel_norm(self.alpha / factor(level**2 - self.beta**2)) <= 1.0

    def agrees(self, gamma_star, share):
        """Whether `gamma_star` is right to within `share`: reached that much above, not that much below."""
        return self.is_reached(gamma_star * (1 + share)) and not self.is_reached(gamma_star * (1 - share))


def factor(power):
    """The stable, stably invertible function whose squared magnitude is `power`, by its cepstrum."""
    cepstrum = np.fft.ifft(np.log(power)).real
    cepstrum[0] /= 2.0
    cepstrum[POINTS // 2] /= 2.0
    cepstrum[POINTS // 2 + 1 :] = 0.0
    return np.exp(np.fft.fft(cepstrum))


def hankel_norm(values):
    """Largest singular value of [h_{i + j + 1}], h_k the coefficient of z^k."""
    h = np.fft.ifft(values).real[:0:-1][: 2 * SIZE - 1]  # h_1, h_2, …
    spectrum = np.fft.rfft(h, 4 * SIZE)

    def times(x):
        return np.fft.irfft(spectrum * np.fft.rfft(x.ravel()[::-1], 4 * SIZE))[SIZE - 1 : 2 * SIZE - 1]

    matrix = LinearOperator((SIZE, SIZE), matvec=times, dtype=float)
    return float(np.abs(eigsh(matrix, 1, which="LM", v0=np.ones(SIZE), return_eigenvectors=False)[0]))
