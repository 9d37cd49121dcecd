"""What a design.json holds, as python-control systems."""

from dob_companion.artifact import DobBlock
from dob_companion.synthesis.plant.models import from_data
from dob_companion.synthesis.plant.problem import Problem


def problem_of(block: DobBlock, dt: float) -> Problem:
    """The stored problem of a block."""
    stored = block.problem
    return Problem(
        plant=from_data(stored.plant, dt),
        controller=from_data(stored.controller, dt),
        disturbance_weight=from_data(stored.disturbance_weight, dt),
        noise_weight=from_data(stored.noise_weight, dt),
        delays=(block.delay_samples,) * len(block.axes),
    )
