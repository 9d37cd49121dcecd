"""Frequency sweep of the simulated vehicle over MAVLink: excite, record, estimate, fit (paper, Section III and Fig. 6).

::

    multisine ──► client ◄──MAVLink──► vehicle        flight: the process and the sockets
                    │ u_e, y_n, r by vehicle stamp
                    ▼
                 estimate ──► fit ──► plants.toml, responses.npz, figure

`python -m sitl.sweep --help`; docs/identification.md says what is done and why. It needs numpy, scipy and matplotlib
(the `[design]` extra); the vehicle that it sweeps does not.
"""
