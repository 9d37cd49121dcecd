"""A minimum-phase plant: its zero at −0.5 lies inside the unit circle, so only noise and the link's delay limit it."""

import control as ct
from _show import show

from dob_companion.synthesis import synthesize, zpk

dt = 0.004  # s
G = zpk([-0.5], [1.0, 0.9], 0.05, dt)  # normalized torque to rad/s
C = ct.ss([], [], [], 0.2, dt)  # u = C (r - y_n)
W_d = zpk([-0.8997], [0.9962], 0.19908, dt)
W_n = zpk([0.9949], [-0.925], 3.7584, dt)
result = synthesize(G, C, W_d, W_n, delay_samples=1)

show("minimum_phase", result)
