"""Three coupled axes as one block: the paper's dynamics behind a mixer that is 5 to 20 % wrong."""

import control as ct
import numpy as np
from _show import show

from dob_companion.synthesis import synthesize, zpk

dt = 0.004  # s
mixer = np.array([[1.0, 0.15, -0.1], [0.1, 1.0, 0.2], [-0.05, 0.1, 1.0]])  # what each axis's torque does to the others
gains = (0.6, 1.0, 0.35)  # of roll, pitch and yaw, times pitch's
G = ct.append(*(gain * zpk([-1.716], [1.0, 0.9447], 0.14131, dt) for gain in gains))
G = ct.ss(G.A, G.B @ mixer, G.C, G.D @ mixer, dt)  # rad/s per normalized torque; roll, pitch, yaw
C = ct.append(*(zpk([0.8343, 0.9987], [0.0, 1.0], 0.9002 / gain, dt) for gain in gains))  # u = C (r - y_n)
W_d = ct.append(*(zpk([-0.8997], [0.9962], 0.19908, dt) for _ in range(3)))
W_n = ct.append(*(zpk([0.9949], [-0.925], 3.7584, dt) for _ in range(3)))
result = synthesize(G, C, W_d, W_n, delay_samples=1, axes=("roll", "pitch", "yaw"))

show("mimo_coupled", result)
