"""The page around the sections."""

from collections.abc import Sequence

from docs.paper.section import Section

HEAD = """# The paper's figures beside ours

Printed, with every figure, by

    python -m docs.paper

The source is “H∞ Based Disturbance Observer Design for Non-minimum Phase Systems with Application to UAV Attitude
Control”. Its figures 1 to 5 are block diagrams; 6 to 16 hold results and follow here in its order, what it says beside
what comes out here. “Agrees” is decided by the bounds in the column before it, not by eye. The paper prints few
numbers; where it says a thing in words, the bounds are our reading of them.
"""


def page(sections: Sequence[Section]) -> str:
    """docs/paper.md."""
    numbers = [number for section in sections for number in section.numbers]
    agreeing = sum(number.agrees for number in numbers)
    lines = [HEAD, f"{agreeing} of {len(numbers)} numbers agree.", ""]
    missed = [(s.figures, n) for s in sections for n in s.numbers if not n.agrees]
    lines += [f"- {figure}: {n.what}: {n.ours:.4g} {n.unit}, accepted {n.accepted}" for figure, n in missed]
    lines += [""] if missed else []
    return "\n".join([*lines, *(section.markdown() for section in sections)])
