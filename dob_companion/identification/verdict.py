"""Whether a design may be made from what was seen, in one line: what speaks for it, or why not and what to fly next."""

import numpy as np

from dob_companion.artifact import AXES
from dob_companion.identification import clock
from dob_companion.identification.grid import HOLE, Grid, overlap, timing
from dob_companion.identification.record import Record, Signal
from dob_companion.identification.result import AxisModel, Floats, Response
from dob_companion.identification.segments import DISARMED, FULL, LANDED, LIMITED, SHORTEST_S, USED, stretches
from dob_companion.identification.segments import HOLE as HOLED
from dob_companion.mavlink.makes import ARDUPILOT, PX4

NEITHER_HOVERS = ("rover", "boat", "submarine", "plane", "airship", "tracker", "helicopter")
SLOWEST = 0.6
"""Least rates of gyro and moment, of the design's."""
STRAIGHT = 1e-3
"""A bend is less than this share of the slopes where a signal goes straight on."""
AT_STOPS = 0.05
"""Share of the time that a signal may stand at its largest or smallest value."""
LEAST_SAMPLES = 10
BANDS = 6
"""Frequencies at least that a model is fitted to."""
LOW_HZ, HIGH_HZ = 2.5, 4.0
"""The band must reach down and up to here, and up to where the rate loop's gain is 1."""
WIDE = 2.0
"""Largest ratio of the ends of the gain's interval."""
LATE_S = 0.025
"""Largest width of the delay's interval."""
WRONG, FAR_OFF = 4.0, 0.25
"""Held-out χ² and misfit that together refute a model."""
PLAUSIBLE = (0.5, 2e4)
"""rad/s² per unit of torque, from a heavy aircraft's yaw to a racer's roll."""
APART = 0.15
"""Largest relative standard deviation of the gain from segment to segment."""

SATURATED = "saturated throughout: fly calmer, or excite with a smaller amplitude"

EXCITE = "record over the link with `dob-companion excite`"
DOUBLETS = "excite, or fly stick doublets in a mode that holds attitude"
FASTER = {
    PX4: "PX4 SDLOG_PROFILE with high rate and system identification",
    ARDUPILOT: "ArduPilot LOG_BITMASK with fast attitude and LOG_FILE_RATEMAX 0",
}


def unfit(record: Record, rate_hz: float) -> str:
    """Why nothing can be made of a record at all; "" where something may."""
    if any(word in record.vehicle for word in NEITHER_HOVERS) and "vtol" not in record.vehicle:
        return f"a {record.vehicle} does not hover: only rotors' and tail-sitters' hover is identified"
    signals = {"gyro": record.rates, "moment": record.moment}
    faster = f"{EXCITE}, or log faster: {FASTER.get(record.make) or ', '.join(FASTER.values())}"
    if why := next(filter(None, (_useless(name, signal, rate_hz, faster) for name, signal in signals.items())), ""):
        never = record.armed is not None and len(record.armed.time) and not record.armed.holds.any()
        return f"{why}; besides, it was disarmed throughout" if never else why
    begin, end = overlap(record)
    if end - begin < SHORTEST_S:
        return f"gyro and moment are there together for {max(0.0, end - begin):.1f} s only"
    return clock.doubt(record)


def _useless(name: str, signal: Signal, rate_hz: float, faster: str) -> str:
    if len(signal.time) < LEAST_SAMPLES:
        return f"{len(signal.time)} samples of the {name}: {EXCITE}"
    if not (np.all(np.isfinite(signal.values)) and np.all(np.diff(signal.time) > 0.0)):
        return f"the {name}'s samples are not finite or not in order of time"
    if not np.any(np.ptp(signal.values, axis=0)):
        return f"the {name} never changes: {EXCITE}"
    if name == "moment" and np.mean(np.any(np.abs(signal.values) >= FULL, axis=1)) > 0.5:
        return SATURATED
    return _too_slow(name, signal, rate_hz, faster) or _cut_off(name, signal)


def _too_slow(name: str, signal: Signal, rate_hz: float, faster: str) -> str:
    hz = timing(signal).rate_hz
    if hz < SLOWEST * rate_hz:
        return f"{name} at {hz:.3g} Hz is too slow for a design at {rate_hz:g} Hz: {faster}"
    if (news := telling_hz(signal)) < SLOWEST * rate_hz:
        return (
            f"{name} at {hz:.3g} Hz tells something new at {news:.3g} Hz only, between lies what was put in: "
            f"too slow for a design at {rate_hz:g} Hz: {faster}"
        )
    return ""


def telling_hz(signal: Signal) -> float:
    """At what rate a signal tells something new: steps or bends, in any channel. What was logged slowly and put on a
    finer raster is held in between, or on straight lines. Where it stands still altogether nothing is told by it."""
    steps = np.diff(signal.values, axis=0)
    slopes = steps / np.diff(signal.time)[:, None]
    steep = np.abs(slopes[1:]) + np.abs(slopes[:-1])
    changes = signal.time[1:][np.any(steps != 0.0, axis=1)]
    bends = signal.time[1:-1][np.any(np.abs(np.diff(slopes, axis=0)) > STRAIGHT * steep, axis=1)]
    rates = [1.0 / float(np.median(np.diff(at))) for at in (changes, bends) if len(at) >= LEAST_SAMPLES]
    return min(rates) if len(rates) == 2 else 0.0


def _cut_off(name: str, signal: Signal) -> str:
    """Whether a channel stands at one end of its range for long, short of what segments know as saturated."""
    for axis, values in zip(AXES, signal.values.T, strict=False):
        for end in (float(values.max()), float(values.min())):
            share = float(np.mean(np.abs(values - end) <= 1e-6 * abs(end))) if end else 0.0
            if share > AT_STOPS and (name == "gyro" or abs(end) < FULL):
                return (
                    f"the {name} of {axis} stands at {end:.3g} for {100.0 * share:.0f} % of the time: it is cut off "
                    "there, and what was beyond is not told"
                )
    return ""


def not_flown(state: np.ndarray, grid: Grid) -> str:
    """Why no stretch is left, by what speaks against most of the record; "" where one is."""
    if stretches(state == USED, grid.dt):
        return ""
    if np.all((state == DISARMED) | (state == HOLED)):
        return "disarmed throughout: these are not the motors' moments"
    counts = {code: int(np.count_nonzero(state == code)) for code in (LIMITED, LANDED, HOLED, DISARMED)}
    worst = max(counts, key=lambda code: counts[code])
    if worst == LIMITED:
        return SATURATED
    if worst == LANDED:
        return "never in flight: fly in hover"
    if worst == DISARMED:
        return "armed and in flight too short: fly a minute in hover"
    return f"full of holes: no {SHORTEST_S:g} s without a step of more than {HOLE:g} usual ones: log to a faster card"


def not_covered(response: Response, crossover_hz: float) -> str:
    """Why a band is too narrow to design by; "" where it is not."""
    low, high = response.frequency[[0, -1]] / (2.0 * np.pi)
    needed = max(HIGH_HZ, crossover_hz)
    said = f"only {low:.2g} to {high:.2g} Hz are seen"
    if low > LOW_HZ:
        return f"{said}, from {LOW_HZ:g} Hz is needed: excite longer or stronger at low frequencies"
    if high < needed:
        return f"{said}, up to {needed:.2g} Hz is needed: {EXCITE}, or fly sharper doublets"
    return ""


def not_one_aircraft(model: AxisModel, between: float, gains: Floats) -> str:
    """Why a model cannot be an aircraft's, or not one's throughout; "" where it can."""
    if model.acceleration_per_unit.value <= 0.0:
        return "the gain is negative: a sign is flipped, or axes are swapped, or this shows the controller"
    if not PLAUSIBLE[0] <= model.acceleration_per_unit.value <= PLAUSIBLE[1]:
        return (
            f"a gain of {model.acceleration_per_unit.value:.3g} rad/s² per unit is no aircraft's: "
            "are rates in rad/s and moments from -1 to 1?"
        )
    if between > APART:
        said = ", ".join(f"{value:.3g}" for value in gains)
        return f"the gain differs between segments ({said} rad/s² per unit): payload, battery or scaling changed"
    return ""


def not_known(model: AxisModel) -> str:
    """Why a model is known too badly; "" where it is not."""
    gain, delay = model.acceleration_per_unit, model.delay_s
    if gain.low <= 0.0 or gain.high > WIDE * gain.low:
        return f"the gain is known too badly ({gain.low:.3g} to {gain.high:.3g}): excite longer or stronger"
    if delay.high - delay.low > LATE_S:
        return (
            f"the delay is known too badly ({1e3 * delay.low:.0f} to {1e3 * delay.high:.0f} ms): "
            "excite at higher frequencies"
        )
    if model.held_out_chi2 > WRONG and model.held_out_misfit > FAR_OFF:
        return (
            f"the model is {100.0 * model.held_out_misfit:.0f} % wrong in windows that it was not fitted to: "
            "fly calmer and steadier"
        )
    return ""


def praise(model: AxisModel, response: Response) -> str:
    """What speaks for a model."""
    low, high = response.frequency[[0, -1]] / (2.0 * np.pi)
    gain = model.acceleration_per_unit
    width = 50.0 * (gain.high - gain.low) / gain.value
    line = f"seen from {low:.2g} to {high:.2g} Hz by the {response.instrument}, gain within {width:.2g} %"
    if np.isfinite(model.held_out_misfit):
        line += f", {100.0 * model.held_out_misfit:.2g} % off in windows that were not fitted"
    return line
