"""The airframe as everything else sees it; nothing else in the package knows which one flies."""

from typing import Protocol

from sitl.airframe.condition import Condition
from sitl.airframe.surroundings import Surroundings
from sitl.attitude import Quaternion, Vector


class Airframe(Protocol):
    """A body in the air, advanced one sample at a time.

    `rate` is the body rate in hover axes, rad/s; `attitude` turns hover axes into north-east-down; `position` and
    `velocity` are m and m/s from the take-off point, north-east-down; `altitude` and `climb` are their vertical part,
    up positive; `specific_force` is what an accelerometer feels, m/s², hover axes; `condition` is its loads and faults.
    `rate` holds what flexing adds to the gyro, `attitude` does not.
    """

    rate: Vector
    attitude: Quaternion
    on_ground: bool
    specific_force: Vector
    condition: Condition

    @property
    def altitude(self) -> float: ...  # noqa: D102
    @property
    def climb(self) -> float: ...  # noqa: D102
    @property
    def position(self) -> Vector: ...  # noqa: D102
    @property
    def velocity(self) -> Vector: ...  # noqa: D102

    def advance(self, torque: Vector, thrust: float, around: Surroundings) -> None:
        """Fly one sample of `DT` seconds with these inputs held.

        `torque` (u_e, about roll, pitch, yaw; −1…1) and `thrust` (0…1) are what the mixer found possible; the
        disturbance `around.torque` adds to u_e at the plant's input.
        """
        ...
