"""A flexible arm: hub torque to hub rate, two lightly damped modes that the observer must not excite.

Frequencies and damping are those of a laboratory arm's size (first bending mode near 4 Hz), not of one in particular.
"""

import control as ct
from _show import show

from dob_companion.synthesis import synthesize, zpk

dt, s = 0.004, ct.tf("s")
G = 40 / (s + 2)  # rigid: rad/s per unit torque
for low, high, damping in ((16.0, 25.0, 0.01), (90.0, 130.0, 0.01)):  # antiresonance and resonance, rad/s
    G *= (s**2 / low**2 + 2 * damping * s / low + 1) / (s**2 / high**2 + 2 * damping * s / high + 1)
G = ct.sample_system(ct.ss(G), dt, method="zoh")
C = ct.ss([], [], [], 0.1, dt)  # u = C (r - y_n)
W_d = zpk([-0.8997], [0.9962], 0.19908, dt)
W_n = zpk([0.9949], [-0.925], 3.7584, dt)
result = synthesize(G, C, W_d, W_n, delay_samples=1)

show("flexible_arm", result)
