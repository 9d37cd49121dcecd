"""A vehicle of no known make that tells its rate controllers (docs/interfaces.md, "On the wire: the vehicle").

Each sample of `SIM_RATE_HZ`, u = P e + I T sum(e before) + D (e - e before) / T with e the rate asked for less the
streamed one, unfiltered. Written in s so that Tustin's rule at that rate gives exactly this.
"""

from dob_companion.autopilots.autopilot import Autopilot, RateLoop
from dob_companion.autopilots.parameters import Parameters
from dob_companion.autopilots.transfer import Transfer, pid

_AXES = {"roll": "SIM_ROLLRATE_", "pitch": "SIM_PITCHRATE_", "yaw": "SIM_YAWRATE_"}
_RATE, _ATTITUDE = "SIM_RATE_HZ", "SIM_ATT_P"


def _loop(parameters: Parameters, axis: str) -> RateLoop:
    own = _AXES[axis]
    p, i, d = (parameters.need(own + what) for what in "PID")
    half = 0.5 / parameters.positive(_RATE)
    return RateLoop(
        controller=pid(p - i * half, i, d, Transfer((1.0, 0.0), (half, 1.0))),
        about_controller=(", ".join(parameters.said(own + what) for what in "PID"), parameters.said(_RATE)),
    )


CONTRACT = Autopilot(
    name="the vehicle",
    telltale=_AXES["roll"] + "P",
    names=(*(own + what for own in _AXES.values() for what in "PID"), _ATTITUDE, _RATE),
    attitude_gain=_ATTITUDE,
    delay_samples=1,
    loop=_loop,
)
