"""Closed-loop gains of one axis in 60 decimal digits: the oracle of what is measured in floating point.

Plant, controller and weights are taken from their roots, the observer from its matrices by Gaussian elimination, the
loop is closed by hand. Nothing of the package is used, and no digit that matters is lost however poles cluster.
"""

from decimal import Decimal, localcontext

import numpy as np

DIGITS = 60


class Complex:
    """Just enough of a complex Decimal."""

    def __init__(self, re, im=0):
        self.re, self.im = Decimal(re), Decimal(im)

    @classmethod
    def of(cls, value):
        if isinstance(value, cls):
            return value
        value = complex(value)
        return cls(value.real, value.imag)

    def __add__(self, other):
        other = Complex.of(other)
        return Complex(self.re + other.re, self.im + other.im)

    def __neg__(self):
        return Complex(-self.re, -self.im)

    def __sub__(self, other):
        return self + -Complex.of(other)

    def __rsub__(self, other):
        return Complex.of(other) - self

    def __mul__(self, other):
        other = Complex.of(other)
        return Complex(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)

    __radd__, __rmul__ = __add__, __mul__

    def __truediv__(self, other):
        other = Complex.of(other)
        size = other.re * other.re + other.im * other.im
        return self * Complex(other.re / size, -other.im / size)

    def power(self):
        return self.re * self.re + self.im * self.im


def on_circle(angle):
    """z = e^(j angle) to the last digit, by way of t = tan(angle / 2), which is taken as exact."""
    t = Decimal(float(np.tan(angle / 2)))
    room = 1 + t * t
    return Complex((1 - t * t) / room, 2 * t / room)


def factored(zeros, poles, gain):
    """G(z) from its roots."""

    def G(z):
        value = Complex.of(gain)
        for zero in zeros:
            value = value * (z - zero)
        for pole in poles:
            value = value / (z - pole)
        return value

    return G


def row(system):
    """D(z) of one output from its matrices, as a list over inputs."""
    A, B, C, D = (np.asarray(M, dtype=float) for M in (system.A, system.B, system.C, system.D))
    n, m = B.shape

    def response(z):
        rows = [
            [(z if i == j else 0) - Complex.of(A[i, j]) for j in range(n)] + [Complex.of(b) for b in B[i]]
            for i in range(n)
        ]
        for k in range(n):
            pivot = max(range(k, n), key=lambda i: rows[i][k].power())
            rows[k], rows[pivot] = rows[pivot], rows[k]
            for i in range(n):
                if i != k and rows[i][k].power():
                    share = rows[i][k] / rows[k][k]
                    rows[i] = [a - share * b for a, b in zip(rows[i], rows[k], strict=True)]
        return [
            sum((Complex.of(C[0, k]) * rows[k][n + j] / rows[k][k] for k in range(n)), Complex.of(D[0, j]))
            for j in range(m)
        ]

    return response


def loop_gains(plant, controller, observer, delay, W_d, W_n):
    """(error, margin, noise) at z: gains squared of weighted error, S - 1/2 and n -> d_hat.

    All arguments but observer and delay are functions G(z).
    """
    estimate = row(observer)

    def gains(z):
        G, C, (D_y, D_u), late = plant(z), controller(z), estimate(z), Complex(1)
        for _ in range(delay):
            late = late / z
        # u_e = -C y_n - late d_hat, d_hat = D_y y_n + D_u u_e, y_n = G (u_e + d) + n
        K = (C + late * D_y) / (1 + late * D_u)  # u_e = -K y_n
        S = Complex(1) / (1 + K * G)
        hat_d, hat_n = (D_y - D_u * K) * G * S, (D_y - D_u * K) * S
        error = ((1 - late * hat_d) * W_d(z)).power() + (late * hat_n * W_n(z)).power()
        return error, (S - 0.5).power(), hat_n.power()

    return gains


def peaks(gains, angles, near=1e-6):
    """The largest of each gain over 0 … pi: on a grid, then by golden section beside its highest point."""
    with localcontext() as context:
        context.prec = DIGITS
        rows = [gains(on_circle(angle)) for angle in angles]
        found = []
        for i, sizes in enumerate(zip(*rows, strict=True)):
            k = max(range(len(sizes)), key=lambda k: sizes[k])
            low, high = angles[max(k - 1, 0)], angles[min(k + 1, len(angles) - 1)]
            best = _golden(lambda z, i=i: gains(z)[i], low, high, near)
            found.append(float(max(best, sizes[k]).sqrt()))
        return found


def _golden(power, low, high, near):
    ratio = (np.sqrt(5.0) - 1.0) / 2.0
    inner, outer = high - ratio * (high - low), low + ratio * (high - low)
    at_inner, at_outer = power(on_circle(inner)), power(on_circle(outer))
    while high - low > near * high:
        if at_inner > at_outer:
            high, outer, at_outer = outer, inner, at_inner
            inner = high - ratio * (high - low)
            at_inner = power(on_circle(inner))
        else:
            low, inner, at_inner = inner, outer, at_outer
            outer = low + ratio * (high - low)
            at_outer = power(on_circle(outer))
    return max(at_inner, at_outer)
