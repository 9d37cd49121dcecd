"""A simulated quadrotor tail-sitter that speaks MAVLink 2, for flying a disturbance observer against it.

`python -m sitl paper` flies the paper's comparison. The package shares no code with `dob_companion`: the two meet
only as bytes on a link, so a misread field cannot cancel itself out.

One gyro sample, from the air to the wire and back::

    weather ──► airframe ──► vehicle ──► flight ──► wire.endpoint ──► links
     d, n       rate, q      y_n, u_e    script      MAVLink           sockets
                                ▲                        │
                                └──── correction ◄───────┘

Everything left of `links` is pure: time and bytes come in as arguments. `run` owns clock and sockets.
"""
