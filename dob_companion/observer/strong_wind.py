"""What a design's model does not foresee, to be judged: nearly white also in wind much stronger than the design weighs.

A predictor made for weak wind takes strong wind in late. What it did not foresee then comes in waves, as its own
bandwidth has them, and looks like a loop that rings. One made for strong wind does not wait; noise then passes it
unfiltered, and is small beside all that counts as ringing.
"""

import numpy as np

from dob_companion.artifact import AXES, DobDesign
from dob_companion.observer.model import Axes3, GyroModel, predictor_of

NOISE_SCALE = 0.1
"""Of the noise weights: wind ten times as strong as the design weighs it. With a thirtieth, a fast plant's innovation
rises with frequency and chance makes waves of it again."""

ALIKE_HZ = 12.0
"""In the middle of the frequencies at which loops ring, on a logarithmic scale."""


class StrongWind:
    """The innovation of the design's plants in strong wind, in units in which one of ALIKE_HZ is as large as that of
    the design's own predictor (`GyroModel`)."""

    def __init__(self, design: DobDesign, *, revisable: int = 0) -> None:
        """`revisable`: so many steps may be revised."""
        self._model = GyroModel(design, longest=0, revisable=revisable, noise_scale=NOISE_SCALE)
        self._unit, angle = np.ones(3), 2.0 * np.pi * ALIKE_HZ * design.dt
        for block in design.blocks:
            own, here = (predictor_of(block.problem, scale).shaping(angle) for scale in (1.0, NOISE_SCALE))
            self._unit[[AXES.index(axis) for axis in block.axes]] = here / own

    def advance(self, y_n: Axes3, u_e: Axes3) -> Axes3:
        """As `GyroModel.advance`."""
        roll, pitch, yaw = (self._unit * self._model.advance(y_n, u_e)).tolist()
        return roll, pitch, yaw

    def revise(self, ago: int, y_n: Axes3, u_e: Axes3) -> None:
        """As `ObserverBank.revise`."""
        self._model.revise(ago, y_n, u_e)

    def reset(self) -> None:
        """Forget everything: the zero state."""
        self._model.reset()
