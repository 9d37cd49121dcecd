"""The rate controllers of an aircraft as lines of a spec: from its autopilot's parameters, or out of another spec."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from dob_companion import toml
from dob_companion.autopilots import Parameters, Sourced, recognized
from dob_companion.autopilots.written import comment, model_lines
from dob_companion.errors import InputError
from dob_companion.synthesis.spec.auto import ATTITUDE_GAIN
from dob_companion.synthesis.spec.parse import FORMS

_KEYS = (*(key for keys in FORMS.values() for key in keys), "domain", "method", "delay_s")


@dataclass(frozen=True, slots=True, kw_only=True)
class Controllers:
    """C(z) of u = C (r - y) by axis, each as the lines below [block.controller].

    attitude_gain   rate asked for per attitude error in roll and pitch, 1/s
    delay_samples   of a design, where no link was measured
    least_delay     samples that this autopilot's own loop takes on any link
    remarks         what its parameters do that no linear model holds
    """

    lines: Mapping[str, tuple[str, ...]]
    attitude_gain: Sourced
    delay_samples: Sourced
    least_delay: int = 1
    remarks: tuple[str, ...] = ()


def by_parameters(parameters: Parameters, axes: Iterable[str]) -> Controllers:
    """Raises InputError, one line that names the parameter that is missing or useless."""
    autopilot = recognized(parameters)
    loops = {axis: autopilot.loop(parameters, axis) for axis in axes}
    for axis, loop in loops.items():
        if not any(loop.controller.num):
            raise InputError(
                f"{parameters.source}: the {axis} rate controller's gains are all 0: {loop.about_controller[0]}"
            )
    return Controllers(
        lines={
            axis: (*comment("; ".join(loop.about_controller)), *model_lines(loop.controller.monic, "tustin"))
            for axis, loop in loops.items()
        },
        attitude_gain=Sourced(parameters.need(autopilot.attitude_gain), parameters.said(autopilot.attitude_gain)),
        delay_samples=Sourced(
            autopilot.delay_samples, "least for this autopilot; `excite` and `doctor` measure the link's"
        ),
        least_delay=autopilot.delay_samples,
        remarks=tuple(dict.fromkeys(remark for loop in loops.values() for remark in loop.remarks)),
    )


def of_spec(text: str, source: str, axes: Iterable[str]) -> Controllers:
    """Those of another spec's blocks, of one axis each. Raises InputError, one line that names the axis or key."""
    raw = toml.read(text, source, InputError)
    given = toml.Table(source, raw, None, InputError).tables("block")
    blocks = [block for block in given if isinstance(block, dict)]
    lines = {}
    for axis in axes:
        mine = [block for block in blocks if block.get("axes") == [axis]]
        if not mine:
            raise InputError(f'{source}: no [[block]] with axes = ["{axis}"], whose controller is wanted')
        table = toml.Table(f"{source}: block {axis}: controller", mine[0].get("controller"), _KEYS, InputError)
        lines[axis] = (f"# as in {' '.join(source.split())}", *_written(table))
    auto, design = (toml.Table(f"{source}: {key}", raw.get(key, {}), None, InputError) for key in ("auto", "design"))
    gain = Sourced(ATTITUDE_GAIN, "the default")
    if "attitude_gain" in auto:
        gain = Sourced(auto.number("attitude_gain", lambda x: x >= 0.0, "a number of 0 or more"), source)
    return Controllers(lines=lines, attitude_gain=gain, delay_samples=Sourced(design.whole("delay_samples", 1), source))


def _written(table: toml.Table) -> Iterator[str]:
    for key in _KEYS:
        if key in table:
            yield f"{key} = {_value(table.get(key))}"


def _value(value: Any) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return repr(value)
