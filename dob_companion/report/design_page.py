"""The page of a design: each block's problem, its certificate in words, the paper's Figs. 6–10 and its margins."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dob_companion.analysis.attained import attained
from dob_companion.analysis.design import TEST_MOMENT, AxisValues, BlockValues, block_values, verdicts
from dob_companion.artifact import DobBlock, DobDesign, StateSpaceData
from dob_companion.report import bode_charts, design_charts
from dob_companion.report.attained_bar import AttainedBar, attained_bar
from dob_companion.report.claims import Claim, claims, further
from dob_companion.report.draw import alone
from dob_companion.report.page import PageFigure, figure, render
from dob_companion.report.robust_chart import robust_claims, robust_figures
from dob_companion.report.tradeoff_chart import tradeoff_figures
from dob_companion.report.words import listed, number, plural, transfer_function
from dob_companion.synthesis.certify.behaviour import Complex, Roots
from dob_companion.synthesis.tune.limits import Tuning


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockSection:
    """One block as its section of the page shows it."""

    key: str
    name: str
    title: str
    row: dict[str, str]
    diagram: dict[str, str]
    models: list[tuple[str, str]]
    coupled: bool
    claims: tuple[Claim, ...]
    further: list[tuple[str, str]]
    responses: list[PageFigure]
    margins: list[PageFigure]
    tuning: list[PageFigure]
    attained: AttainedBar | None


def design_page(design: DobDesign, tunings: Sequence[Tuning] = ()) -> str:
    """Self-contained HTML of one design; everything on it follows from the design's own matrices and certificate.

    `tunings`, one for each block when its weights were searched, add how they were chosen.
    """
    return design_report(design, tunings)[0]


def design_report(design: DobDesign, tunings: Sequence[Tuning] = ()) -> tuple[str, dict[str, str]]:
    """The page of `design_page`, and its figures as SVG files that stand alone, by file name: AXES-FIGURE.svg."""
    sections = [_section(block, index, design.dt) for index, block in enumerate(design.blocks)]
    for section, tuning in zip(sections, tunings, strict=False):
        section.tuning.extend(tradeoff_figures(section.key, tuning))
    axes = tuple(axis for block in design.blocks for axis in block.axes)
    page = render(
        "design.html.j2",
        title=f"Disturbance observer for {listed(axes)}",
        generator=design.generator,
        sha256=design.sha256,
        meta=[
            f"{1.0 / design.dt:g} Hz",
            f"link delay {plural(design.delay_samples, 'sample')} ({design.delay_samples * design.dt * 1e3:g} ms)",
            *dates(design),
        ],
        certified=all(claim.holds for section in sections for claim in section.claims),
        sections=sections,
    )
    figures = {}
    for block, section in zip(design.blocks, sections, strict=True):
        for shown in (*section.responses, *section.margins, *section.tuning):
            name = shown.key.removeprefix(f"{section.key}-")
            figures[f"{'-'.join(block.axes)}-{name}.svg"] = alone(str(shown.svg))
    return page, figures


def dates(design: DobDesign) -> list[str]:
    """When the design was made and the beginning of its hash, as far as it knows them."""
    return [f"designed {design.created}"] * bool(design.created) + [f"design {design.sha256[:8]}"] * bool(design.sha256)


def certificate_row(block: DobBlock) -> dict[str, str]:
    """A block's line in the table of certificates."""
    proof = block.certificate
    return {
        "name": block.name,
        "axes": listed(block.axes),
        "states": str(block.observer.order),
        "gamma": number(proof.gamma, 5),
        "gamma_star": number(proof.gamma_star, 5),
        "ratio": number(verdicts(block).ratio, 5),
        "bandwidth": number(proof.estimation_bandwidth_hz, 3, "Hz"),
        "disk_margin": number(proof.disk_margin, 3),
        "delay_margin": plural(proof.delay_margin_samples, "sample"),
    }


def _section(block: DobBlock, index: int, dt: float) -> BlockSection:
    key = f"b{index}"
    values, found = block_values(block, dt), attained(block, dt)
    return BlockSection(
        key=key,
        name=block.name,
        title=block.name if (block.name,) == block.axes else f"{block.name} ({listed(block.axes)})",
        row=certificate_row(block),
        diagram=_diagram(block, key, dt),
        models=_models(block, values),
        coupled=len(block.axes) > 1,
        claims=(*claims(block, dt), *robust_claims(block)),
        further=further(block.certificate.extra),
        responses=_response_figures(key, values),
        margins=[*_margin_figures(key, block, values), *robust_figures(key, block, values.bands)],
        tuning=[],
        attained=attained_bar(f"{key}-attained", found) if found else None,
    )


def _diagram(block: DobBlock, key: str, dt: float) -> dict[str, str]:
    problem, tau = block.problem, block.delay_samples
    parts = {
        "controller": problem.controller,
        "plant": problem.plant,
        "disturbance_weight": problem.disturbance_weight,
        "noise_weight": problem.noise_weight,
    }
    notes = {name: plural(data.order, "state") for name, data in parts.items()}
    observer = f"{plural(block.observer.order, 'state')}, γ = {number(block.certificate.gamma, 4)}"
    delay = f"link, {tau * dt * 1e3:g} ms"
    return {"key": key + "-diagram", "observer": observer, "delay_samples": str(tau), "delay": delay, **notes}


def _models(block: DobBlock, values: BlockValues) -> list[tuple[str, str]]:
    problem = block.problem
    named = (
        ("plant G(z)", problem.plant, values.plant),
        ("controller C(z)", problem.controller, values.controller),
        ("weight W_d(z)", problem.disturbance_weight, values.disturbance_weight),
        ("weight W_n(z)", problem.noise_weight, values.noise_weight),
    )
    poles = ", ".join(_root(pole) for pole in _upper(values.observer.poles))
    return [(name, _model(data, r)) for name, data, r in named] + [("observer D(z), poles", poles or "none")]


def _model(data: StateSpaceData, r: Roots) -> str:
    if np.isfinite(r.gain):
        return transfer_function(r.zeros, r.poles, r.gain)
    outputs, inputs = data.D.shape
    poles = ", ".join(_root(pole) for pole in _upper(r.poles))
    return f"{outputs} × {inputs}, {plural(data.order, 'state')}" + (f", poles {poles}" if poles else "")


def _upper(values: Complex) -> list[complex]:
    kept = [complex(v) for v in values if v.imag > -1e-12]
    return sorted(kept, key=lambda v: (-abs(v), v.imag))


def _root(value: complex) -> str:
    real = number(value.real if abs(value.real) > 1e-9 else 0.0, 4)
    return real if abs(value.imag) < 1e-9 else f"{real} ± {number(value.imag, 4)}j"


def _response_figures(key: str, values: BlockValues) -> list[PageFigure]:
    charts, axes = bode_charts, [axis.responses for axis in values.axes]
    return [
        figure(
            charts.figure_6(f"{key}-fig6", axes),
            "Fig. 6. Plant and weights.",
            "G from moment to body rate, dB of rad/s per normalized torque. Dashed, the weights: "
            "W_d says where disturbances live, W_n where noise does.",
        ),
        figure(
            charts.figure_7(f"{key}-fig7", axes),
            "Fig. 7. Q and the inverse model.",
            "The observer in the standard form d̂ = Q (Gₙ⁻¹ y_n − u_e). Being deaf to commands makes Gₙ⁻¹ = G⁻¹ at "
            "every frequency: the two curves lie on each other, and Q alone says how far the estimate reaches.",
        ),
        figure(
            charts.figure_8(f"{key}-fig8", axes),
            "Fig. 8. Disturbance to estimate.",
            "d → d̂ as computed; below, what the correction leaves once the link's delay is counted. γ / |W_d| is the "
            "level that the certificate guarantees.",
        ),
        figure(
            charts.figure_9(f"{key}-fig9", axes),
            "Fig. 9. Disturbance to body rate.",
            "dB of rad/s per normalized torque, rate loop closed. Where the blue curve is above the other the observer "
            "amplifies: the price of attenuation below.",
        ),
        figure(
            charts.figure_10(f"{key}-fig10", axes),
            "Fig. 10. Noise to estimate.",
            "n → d̂, dB of normalized torque per rad/s, with the level γ / |W_n| that the certificate guarantees.",
        ),
    ]


def _margin_figures(key: str, block: DobBlock, values: BlockValues) -> list[PageFigure]:
    found = [
        each
        for i, (axis, of) in enumerate(zip(block.axes, values.axes, strict=True))
        for each in _axis_figures(key, i, of, f" ({axis})" if len(block.axes) > 1 else "")
    ]
    found.append(
        figure(
            design_charts.pole_zero_map(f"{key}-roots", values.plant, values.observer, values.closed_loop_poles),
            "Poles and zeros.",
            "Stable means that all poles of the closed loop and of the observer lie inside the unit circle. A plant "
            "zero outside it makes the plant non-minimum phase: it has no stable inverse.",
        )
    )
    return found


def _axis_figures(key: str, i: int, axis: AxisValues, of: str) -> list[PageFigure]:
    """`of` names the axis where there are several."""
    hertz, margin = axis.responses.of.frequency_hz, axis.disk_margin
    return [
        figure(
            design_charts.nyquist(f"{key}-nyquist{i}", hertz, axis.open_loop_off, axis.open_loop_on, margin),
            f"Margins{of}.",
            f"Open loop, broken at u_e{' of this axis' if of else ''}, near −1. The dashed disk is its disk margin "
            f"{number(margin, 3)}: the curve with the observer stays out of it.",
        ),
        figure(
            design_charts.time_response(f"{key}-step{i}", "step", axis.step),
            f"Step{of}.",
            f"A disturbance of {TEST_MOMENT:g} that begins at t = 0; rate loop closed, no attitude loop.",
        ),
        figure(
            design_charts.time_response(f"{key}-gust{i}", "gust", axis.gust),
            f"Gust{of}.",
            f"A gust of the shape ½ (1 − cos) that lasts {number(axis.gust_s, 3)} s and reaches {TEST_MOMENT:g}.",
        ),
    ]
