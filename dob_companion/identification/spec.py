"""From an identification to the spec that `design --auto` takes: every number with where it comes from."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from dob_companion.autopilots import Sourced
from dob_companion.autopilots.written import comment, listed, model_lines, number
from dob_companion.errors import InputError
from dob_companion.identification.controllers import Controllers
from dob_companion.identification.result import AxisModel, Identification, Interval, Mode
from dob_companion.identification.rigid import rigid
from dob_companion.identification.surroundings import Surroundings
from dob_companion.lti.margins import disk_margin
from dob_companion.lti.response import response
from dob_companion.synthesis.plant.models import to_state_space
from dob_companion.synthesis.spec.auto import NOISE_IN_CORRECTION
from dob_companion.synthesis.spec.parse import BlockSpec, Spec, parse_spec

ASSUMED_CORNER_HZ = 1.0
"""Of gusts, where the recorded air was too calm to show a corner."""

LEAST_NOISE = 5e-4
"""Of a gyro on an aircraft, rad/s: a design for less trusts it more than motors and propellers deserve."""

MARGIN_KEPT, LEAST_MARGIN, MOST_MARGIN = 0.8, 0.2, 0.4
"""The loop with the observer is to keep this share of the disk margin that it has without, within these ends."""

NOISIER, DEVIATIONS = 2.0, 3.0
"""Gyro noise may be this many times as large in the correction as the rate controller makes it in the torque, which the
motors are known to bear; so many deviations of it and of the disturbance stay within what may be corrected."""

QUIETER = 0.9
"""Share of the noisiest axis' noise below which an axis states its own."""

ANGLES = 500
"""Frequencies that a mean over all is taken of."""

LOOP_FROM_HZ, LEAST_LOOP, LOOP_BANDS, LOOP_OFF = 1.5, 0.3, 3, 0.5
"""Loops are compared from so many Hz on, where one is this large, in so many bands: by their distance, relative."""

LIMIT_OF_RMS, LEAST_LIMIT, MOST_LIMIT = 10.0, 0.15, 0.3
"""What the observer is asked to reject at most: this many times the rms that was seen, within these ends."""


def spec_text(
    found: Identification,
    controllers: Controllers,
    surroundings: Mapping[str, Surroundings | None],
    delay_samples: Sourced,
    rate_hz: float,
    moment_rate_hz: Sourced | None = None,
) -> str:
    """TOML for `design --auto`, of all usable axes. `moment_rate_hz`: where the applied moment was read beside the
    controller, how often.

    Raises InputError where none is usable, or where the loop of an axis is unstable already by these numbers.
    """
    axes = found.usable
    if not axes:
        reasons = "; ".join(f"{axis}: {result.why}" for axis, result in found.axes.items())
        raise InputError(f"{found.source}: no axis is usable: {reasons}")
    models = {axis: _model(found, axis) for axis in axes}
    bare = {axis: rigid(model, rate_hz) for axis, model in models.items()}

    def blocks(own: Mapping[str, Sequence[str]]) -> list[str]:
        each = (_block(axis, bare[axis], models[axis].modes, controllers, surroundings.get(axis), own) for axis in axes)
        return [line for lines in each for line in lines]

    head = [*_head(found, controllers), *_design(rate_hz, delay_samples)]
    baseline = _parsed("\n".join([*head, *blocks({})]), found.source)
    _require_same_loop(baseline, found, controllers.attitude_gain.value)
    margin = _baseline_margin(baseline)
    own = _own(baseline, surroundings)
    return "\n".join([*head, *_auto(surroundings, controllers, margin, moment_rate_hz), *blocks(own)]) + "\n"


def _model(found: Identification, axis: str) -> AxisModel:
    model = found.axes[axis].model
    if model is None:
        raise InputError(f"{found.source}: {axis}: no model was found")
    return model


def _head(found: Identification, controllers: Controllers) -> Iterator[str]:
    yield from comment(f"Identified from {' '.join(found.source.split())}")
    yield "#   dob-companion design THIS_FILE --auto -o my-design"
    yield "# Plants: normalized torque -> streamed rate, rad/s. Controllers: C of u = C (r - y), y what is streamed."
    for axis, result in found.axes.items():
        if not result.usable:
            yield from comment(f"{axis} is left out: {result.why}")
    if controllers.remarks:
        yield "# Not in these models:"
        for remark in controllers.remarks:
            yield from comment(f"  {remark}")
    yield ""


def _design(rate_hz: float, delay_samples: Sourced) -> Iterator[str]:
    yield "[design]"
    yield f"rate_hz = {number(rate_hz)}"
    yield f"delay_samples = {delay_samples.value:.0f}   # {delay_samples.source}"
    yield ""


def _auto(
    surroundings: Mapping[str, Surroundings | None],
    controllers: Controllers,
    margin: tuple[str, float],
    moment_rate_hz: Sourced | None,
) -> Iterator[str]:
    seen = {axis: around for axis, around in surroundings.items() if around is not None}
    weakest, baseline = margin
    yield "[auto]"
    yield f"disturbance_corner_hz = {_corner(seen)}"
    noisiest = max(seen, key=lambda axis: seen[axis].noise_rms.value, default=None)
    if noisiest is None:
        yield f"noise_rms = {LEAST_NOISE}   # rad/s; assumed: the record is too short to tell"
    elif seen[noisiest].noise_rms.value < LEAST_NOISE:
        shown = f"{seen[noisiest].noise_rms.value:.2g} was seen, motors shake more"
        yield f"noise_rms = {LEAST_NOISE}   # rad/s; assumed: {shown}"
    else:
        yield f"noise_rms = {number(_round(seen[noisiest].noise_rms.value))}   # rad/s; measured, {noisiest}"
    asked = min(max(MARGIN_KEPT * baseline, LEAST_MARGIN), MOST_MARGIN)
    yield f"least_disk_margin = {number(_round(asked))}   # {weakest} has {baseline:.3f} without observer"
    if moment_rate_hz is not None:
        yield f"moment_rate_hz = {moment_rate_hz.value:.0f}   # {moment_rate_hz.source}"
    yield f"attitude_gain = {number(controllers.attitude_gain.value)}   # {controllers.attitude_gain.source}"
    yield ""


def _own(baseline: Spec, surroundings: Mapping[str, Surroundings | None]) -> dict[str, list[str]]:
    """What an axis asks that [auto] does not: gyro noise less than the noisiest axis', which [auto] states, and more of
    it in the correction than the default."""
    seen = {axis: around for axis, around in surroundings.items() if around is not None}
    noise = {axis: max(LEAST_NOISE, around.noise_rms.value) for axis, around in seen.items()}
    most = max(noise.values(), default=0.0)
    own: dict[str, list[str]] = {}
    for block in baseline.blocks:
        axis = block.name
        if axis not in seen:
            continue
        lines = own.setdefault(axis, [])
        if noise[axis] < QUIETER * most:
            lines.append(f"noise_rms = {number(_round(noise[axis]))}   # rad/s; measured")
        made = noise[axis] * _noise_gain(block, baseline.dt)
        rms = seen[axis].disturbance_rms.value
        room = np.sqrt(max(0.0, (_largest_disturbance(rms) / DEVIATIONS) ** 2 - rms**2))
        if (allowed := min(NOISIER * made, room)) > NOISE_IN_CORRECTION:
            said = f"the rate controller makes {made:.2g} of this gyro's noise"
            lines.append(f"largest_noise_in_correction = {number(float(f'{allowed:.2g}'))}   # {said}")
    return own


def _noise_gain(block: BlockSpec, dt: float) -> float:
    """RMS of the torque that the rate loop makes of white gyro noise of 1 rad/s RMS."""
    angles = (np.arange(ANGLES) + 0.5) / ANGLES * np.pi
    plant, controller = (
        response(to_state_space(model, dt, (1, 1)), angles)[:, 0, 0] for model in (block.plant, block.controller)
    )
    return float(np.sqrt(np.mean(np.abs(controller / (1.0 + plant * controller)) ** 2)))


def _largest_disturbance(rms: float) -> float:
    return min(max(LIMIT_OF_RMS * rms, LEAST_LIMIT), MOST_LIMIT)


def _corner(seen: Mapping[str, Surroundings]) -> str:
    shown = {axis: around.corner_hz for axis, around in seen.items() if around.shows_corner}
    if not shown:
        return f"{ASSUMED_CORNER_HZ}   # assumed: gusts; the air was too calm to show it"
    middle = float(np.exp(np.mean([np.log(corner.value) for corner in shown.values()])))
    said = ", ".join(f"{axis} {corner.value:.2g}" for axis, corner in shown.items())
    return f"{number(_round(middle))}   # measured: {said}"


def _block(
    axis: str,
    model: AxisModel,
    modes: Sequence[Mode],
    controllers: Controllers,
    around: Surroundings | None,
    own: Mapping[str, Sequence[str]],
) -> Iterator[str]:
    """`own`: lines of [block.auto], by axis."""
    yield from ("[[block]]", f'name = "{axis}"', f'axes = ["{axis}"]')
    if around is not None:
        rms = around.disturbance_rms.value
        limit = number(_round(_largest_disturbance(rms)))
        yield f"largest_disturbance = {limit}   # {LIMIT_OF_RMS:g} times the rms of {rms:.2g} that was seen"
    if lines := own.get(axis):
        yield from ("[block.auto]", *lines)
    yield "[block.plant]"
    yield from comment("; ".join(_about(model)))
    for mode in modes:
        yield from comment(
            f"left to the uncertainty: mode at {_said(mode.frequency_hz, 1.0)} Hz, damping {_said(mode.damping, 1.0)}"
        )
    if model.about_filters:
        yield from comment("; ".join(model.about_filters))
    yield from model_lines(model.transfer(), "zoh", model.delay_s.value)
    yield "[block.controller]"
    yield from controllers.lines[axis]
    yield "[block.uncertainty]   # |G_true / G - 1| at most, 95 %: parameters, form of the model, what was not measured"
    for key, values in model.uncertainty().items():
        yield f"{key} = {listed(map(_round, values))}"
    yield ""


def _about(model: AxisModel) -> Iterator[str]:
    yield f"{_said(model.acceleration_per_unit, 1.0)} rad/s² per unit torque"
    yield f"slow pole {_said(model.slow_pole_rad_s, 1.0)} rad/s" if model.slow_pole_rad_s.value else "an integrator"
    if model.lag_s.value:
        yield f"lag {_said(model.lag_s, 1e3)} ms"
    if model.lead_s.value:
        yield f"lead {_said(model.lead_s, 1e3)} ms"
    yield f"delay {_said(model.delay_s, 1e3)} ms"


def _said(interval: Interval, scale: float) -> str:
    value, low, high = (scale * x for x in (interval.value, interval.low, interval.high))
    return f"{value:.4g} ({low:.4g} to {high:.4g})"


def _baseline_margin(spec: Spec) -> tuple[str, float]:
    """The axis whose loop without observer has the smallest disk margin, and that.

    Raises InputError for a loop that is unstable by the model, which flew: one of its numbers is not that of the
    aircraft.
    """
    angles = np.concatenate([np.geomspace(1e-5, 0.05, 300), np.linspace(0.05, np.pi, 3000)])
    margins = {}
    for block in spec.blocks:
        plant, controller = (to_state_space(model, spec.dt, (1, 1)) for model in (block.plant, block.controller))
        loop = plant * controller
        closed = loop.A - loop.B @ loop.C / (1.0 + loop.D.item())
        if np.max(np.abs(np.linalg.eigvals(closed)), initial=0.0) >= 1.0:
            raise InputError(
                f"{spec.source}: {block.name}: the rate loop is unstable by the model and the controller's parameters, "
                "but it flew: are these the parameters of that flight?"
            )
        margins[block.name] = disk_margin(1.0 / (1.0 + response(loop, angles)[:, 0, 0]))
    weakest = min(margins, key=lambda name: margins[name])
    return weakest, margins[weakest]


def _parsed(text: str, source: str) -> Spec:
    """The blocks as `design` reads them; they need an [auto], whatever it asks."""
    return parse_spec(
        text + "\n[auto]\ndisturbance_corner_hz = 1.0\nnoise_rms = 1.0\nleast_disk_margin = 0.1\n", source
    )


def _require_same_loop(spec: Spec, found: Identification, attitude_gain: float) -> None:
    """What closes around an injected signal is C G in any units; raises InputError where model and controller make
    another loop than the record shows."""
    for block in spec.blocks:
        seen = found.axes[block.name].response
        if seen is None or seen.loop is None:
            continue
        w = seen.frequency
        angles = w / found.rate_hz
        plant, controller = (to_state_space(m, 1.0 / found.rate_hz, (1, 1)) for m in (block.plant, block.controller))
        loop = response(plant * controller, angles)[:, 0, 0] * (1.0 + attitude_gain / (1j * w))
        larger = np.maximum(np.abs(loop), np.abs(seen.loop))
        clear = (w > LOOP_FROM_HZ * 2.0 * np.pi) & (larger > LEAST_LOOP)
        if np.count_nonzero(clear) < LOOP_BANDS:
            continue
        off = float(np.median((np.abs(seen.loop - loop) / larger)[clear]))
        if off > LOOP_OFF:
            size = float(np.median(np.abs(seen.loop / loop)[clear]))
            raise InputError(
                f"{found.source}: {block.name}: the rate loop that the record shows is not that of the model and the "
                f"controller's parameters ({size:.2g} times its size, {100.0 * off:.0f} % apart): are these of that "
                "flight, is what was injected part of the moment, are rates in rad/s and moments from -1 to 1?"
            )


def _round(value: float) -> float:
    return float(f"{value:.4g}")
