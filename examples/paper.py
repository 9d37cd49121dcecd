"""The paper's pitch axis, eqs. (11) to (13), with one sample of link delay: integrating and non-minimum phase."""

from _show import show

from dob_companion.synthesis import synthesize, zpk

dt = 0.004  # s
G = zpk([-1.716], [1.0, 0.9447], 0.14131, dt)  # normalized torque to rad/s, eq. (11)
C = zpk([0.8343, 0.9987], [0.0, 1.0], 0.9002, dt)  # u = C (r - y_n), eq. (12)
W_d = zpk([-0.8997], [0.9962], 0.19908, dt)  # where disturbances live, eq. (13)
W_n = zpk([0.9949], [-0.925], 3.7584, dt)  # where noise lives, eq. (13)
result = synthesize(G, C, W_d, W_n, delay_samples=1, axes=("pitch",))

show("paper", result)
