"""A certificate as people read it."""

from collections.abc import Iterable
from dataclasses import fields
from typing import Any

from dob_companion.artifact.design import LARGEST_DISTURBANCE, Certificate, DobDesign

_ROWS = (
    ("order", "observer order", "d"),
    ("gamma", "gamma (measured)", ".5f"),
    ("gamma_star", "gamma_star (lower bound)", ".5f"),
    ("closed_loop_spectral_radius", "closed-loop spectral radius", ".6f"),
    ("observer_spectral_radius", "observer spectral radius", ".6f"),
    ("slowest_mode_s", "slowest mode, s", ".4f"),
    ("command_leak", "command leak", ".1e"),
    ("disk_margin", "disk margin", ".3f"),
    ("delay_margin_samples", "delay margin, samples", "d"),
    ("estimation_bandwidth_hz", "estimation bandwidth, Hz", ".2f"),
    ("missing_samples", "missing samples borne", "d"),
    ("missing_moments", "missing moments borne", "d"),
)
_STATED = (
    (LARGEST_DISTURBANCE, "largest disturbance", ".3f"),
    ("attenuation", "attenuation", ".2f"),
    ("attenuation_limit", "attenuation of any observer", ".2f"),
    ("misreading", "share of a moment misread", ".3f"),
)
"""Rows for what a spec need not say: shown where one does."""


def certificate_object(certificate: Certificate) -> dict[str, Any]:
    """A certificate as it stands in design.json."""
    named = {f.name: getattr(certificate, f.name) for f in fields(Certificate) if f.name != "extra"}
    return named | dict(certificate.extra)


def certificate_table(head: str, observers: Iterable[tuple[str, int, Certificate]]) -> str:
    """Lines of text, one column for each (name, order, certificate)."""
    known = [(name, certificate_object(certificate) | {"order": order}) for name, order, certificate in observers]
    rows = [*_ROWS, *(row for row in _STATED if any(row[0] in values for _, values in known))]
    columns = [[name, *(_number(values.get(key), form) for key, _, form in rows)] for name, values in known]
    labels = [head, *(label for _, label, _ in rows)]
    widths = [max(map(len, column)) for column in (labels, *columns)]
    lines = []
    for label, *cells in zip(labels, *columns, strict=True):
        aligned = (cell.rjust(width) for cell, width in zip(cells, widths[1:], strict=True))
        lines.append("  ".join([label.ljust(widths[0]), *aligned]))
    return "\n".join(lines)


def design_table(design: DobDesign) -> str:
    """The certificates of a design, one column for each block."""
    head = f"{1 / design.dt:g} Hz, delay {design.delay_samples}"
    return certificate_table(head, ((block.name, block.observer.order, block.certificate) for block in design.blocks))


def _number(value: float | None, form: str) -> str:
    """In the form of its row, unless that would show no digit of it or too many; "-" for what a file does not hold."""
    if value is None:
        return "-"
    small = form.endswith("f") and value != 0.0 and not 1e-3 <= abs(value) < 1e7
    return format(value, ".4e" if small else form)
