"""A slow right-half-plane zero: what no observer can do, whatever the noise.

With T = d -> z^−τ d_hat and z0 the plant's zero outside the unit circle, T = z^−τ F N vanishes at z0 (F is stable, N is
the plant's numerator), so 1 − T = 1 there, and by the maximum modulus principle

    gamma >= ||(1 − T) W_d|| >= |W_d(z0)|        (G. Zames and B. A. Francis, IEEE Trans. Autom. Control 28(5), 1983)
"""

import control as ct
import numpy as np
from _show import show

from dob_companion.report.chart import Curve, Panel, Scale
from dob_companion.synthesis import synthesize, zpk

dt, s = 0.004, ct.tf("s")
C = ct.ss([], [], [], 1.0, dt)  # u = C (r - y_n)
W_d = zpk([-0.8997], [0.9962], 0.19908, dt)
W_n = zpk([0.9949], [-0.925], 3.7584, dt)


def design(zero, noise=1.0):
    """The design for a zero at +`zero` rad/s, and |W_d(z0)|."""
    G = ct.sample_system(ct.ss(20 * (zero - s) / (zero * (s + 1) * (s + 20))), dt, method="zoh")
    z0 = max(ct.zeros(G).real)
    return synthesize(G, C, W_d, noise * W_n, delay_samples=1), abs(W_d(z0))


result, bound = design(5.0)
zeros = np.array([2.0, 5.0, 10.0, 20.0, 40.0])
runs = [(design(zero)[0], *design(zero, noise=1e-3)) for zero in zeros]
usual, quiet, limit = np.array([(a.certificate.gamma_star, b.certificate.gamma_star, c) for a, b, c in runs]).T
print(f"zero at 5 rad/s        gamma >= {bound:.4g}; gamma_star with a thousandth of the noise is {quiet[1]:.4g}")
x, y = Scale("zero of the plant", "rad/s", 0.0, 40.0), Scale("γ*", "", 0.0, 40.0)
curves = (
    Curve("|W_d(z₀)|, the limit", zeros, limit, "bound", width=4.0),
    Curve("γ*, usual noise", zeros, usual, "on"),
    Curve("γ*, hardly any noise", zeros, quiet, "extra", dashed=True),
)
show("slow_rhp_zero", result, panel=Panel(0, 1, x, y, curves))
