"""The text of a design spec: controller and filters from parameters, plant from numbers that were given."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from dob_companion.artifact import AXES
from dob_companion.autopilots.autopilot import Autopilot, RateLoop
from dob_companion.autopilots.parameters import Parameters
from dob_companion.autopilots.transfer import Transfer, constant
from dob_companion.autopilots.written import comment, listed, model_lines, number
from dob_companion.errors import InputError

REQUIRED = "REQUIRED"
CORNER_HZ, DISK_MARGIN = 1.0, 0.25
"""Of [auto]. The margin is one that the rate loops which autopilots come with still have."""


@dataclass(frozen=True, slots=True)
class Sourced:
    """A number, and where it comes from."""

    value: float
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Aircraft:
    """What no parameter says, by axis, and "" for all axes; what is left out is 0, except a gain.

    gains      angular acceleration per unit of normalized torque, rad/s²
    poles      of the rate, rad/s, above 0 where it decays by itself
    motors_s   time constant of the motors, s
    delays_s   of the aircraft from torque to rate, without motors, gyro filter and link, s
    """

    gains: Mapping[str, float] = field(default_factory=dict)
    poles: Mapping[str, float] = field(default_factory=dict)
    motors_s: Mapping[str, float] = field(default_factory=dict)
    delays_s: Mapping[str, float] = field(default_factory=dict)


def spec_text(
    autopilot: Autopilot,
    parameters: Parameters,
    aircraft: Aircraft,
    *,
    rate_hz: float,
    delay_samples: Sourced,
    noise_rms: Sourced,
) -> str:
    """TOML for `dob-companion design --auto`. A plant without a gain gets a key that `design` refuses by its name.

    Raises InputError, one line that names the parameter that is missing or useless.
    """
    loops = {axis: autopilot.loop(parameters, axis) for axis in AXES}
    attitude = parameters.need(autopilot.attitude_gain)
    lines = [
        *_head(autopilot, parameters, loops),
        "[design]",
        f"rate_hz = {number(rate_hz)}",
        f"delay_samples = {delay_samples.value:.0f}   # {delay_samples.source}",
        "",
        "[auto]",
        f"disturbance_corner_hz = {CORNER_HZ}   # assumed: gusts",
        f"noise_rms = {number(noise_rms.value)}   # rad/s; {noise_rms.source}",
        f"least_disk_margin = {DISK_MARGIN}   # of the loop with the observer; more, where C and plant allow it",
        *_readings(autopilot),
        f"attitude_gain = {number(attitude)}   # {parameters.said(autopilot.attitude_gain)}",
    ]
    for axis, loop in loops.items():
        lines += ["", *_block(axis, loop, aircraft, parameters.source)]
    return "\n".join(lines) + "\n"


def _readings(autopilot: Autopilot) -> Iterator[str]:
    if autopilot.moment_rate_hz is not None:
        why = "so often its script was seen to read what acts; `tune` measures it"
        yield f"moment_rate_hz = {number(autopilot.moment_rate_hz)}   # {why}"


def _head(autopilot: Autopilot, parameters: Parameters, loops: Mapping[str, RateLoop]) -> Iterator[str]:
    yield f"# {autopilot.name}'s rate loop by its parameters: {' '.join(parameters.source.split())}"
    yield "#   dob-companion design THIS_FILE --auto -o my-design"
    yield "# Plants: normalized torque -> streamed rate, rad/s. Controllers: C(s) of u = C (r - y), y what is streamed."
    remarks = dict.fromkeys(remark for loop in loops.values() for remark in loop.remarks)
    if remarks:
        yield "# Not in these models:"
        yield from (line for remark in remarks for line in comment(f"  {remark}"))
    yield ""


def _block(axis: str, loop: RateLoop, aircraft: Aircraft, source: str) -> Iterator[str]:
    if not any(loop.controller.num):
        raise InputError(f"{source}: the {axis} rate controller's gains are all 0: {loop.about_controller[0]}")
    yield from ("[[block]]", f'name = "{axis}"', f'axes = ["{axis}"]', "[block.plant]")
    yield from _plant(axis, loop, aircraft)
    yield "[block.controller]"
    yield from comment("; ".join(loop.about_controller))
    yield from model_lines(loop.controller.monic, "tustin")


def _plant(axis: str, loop: RateLoop, aircraft: Aircraft) -> Iterator[str]:
    gain = _of(aircraft.gains, axis)
    pole, motor_s, delay_s = (_of(each, axis) or 0.0 for each in (aircraft.poles, aircraft.motors_s, aircraft.delays_s))
    own = Transfer((1.0,), (1.0, pole)) * Transfer((1.0,), (motor_s, 1.0) if motor_s else (1.0,))
    shape, late_s = own * loop.filters, delay_s + loop.late_s
    given = [f"gain {gain:g} rad/s² per unit torque (given)" if gain is not None else f"gain {REQUIRED}"]
    given += [f"pole {pole:g} rad/s (given)"] if pole else ["no pole given: an integrator"]
    given += [f"motors {1e3 * motor_s:g} ms (given)"] if motor_s else []
    given += [f"delay {1e3 * delay_s:g} ms (given)"] if delay_s else []
    yield from comment("; ".join(given))
    yield from comment("; ".join(loop.about_filters))
    if gain is None:
        yield from comment(f"give --gain {axis}=…, or put here the gain times {listed(shape.num)}")
        yield f'num = ["{REQUIRED}: angular acceleration per unit of normalized torque, rad/s²"]'
        yield from model_lines(shape, "zoh", late_s)[1:]
    else:
        yield from model_lines(constant(gain) * shape, "zoh", late_s)


def _of(values: Mapping[str, float], axis: str) -> float | None:
    return values.get(axis, values.get(""))
