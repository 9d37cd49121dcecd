"""Somebody's own aircraft: linear axes under their own rate controllers, and an attitude loop that fits around them."""

from dataclasses import dataclass, replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from sitl.airframe.linear import HOVER_THRUST, PITCH, ROLL, YAW, LinearAirframe
from sitl.airframe.mixer import SeparateAxes
from sitl.airframe.state_space import CoupledRates, StateSpace, beside
from sitl.attitude import Vector
from sitl.autopilot.aircraft import Aircraft
from sitl.autopilot.controller import ATTITUDE_GAIN, MatrixLaw
from sitl.autopilot.tuning import RATE_PIDS, RateGains, Tuning
from sitl.constants import AXES, DT
from sitl.errors import FlightFailedError

Array = NDArray[np.float64]

SENSITIVITY = 1.4
"""Largest peak of the attitude loop's sensitivity, each axis by itself: a phase margin of 42° and a gain margin of 3.5,
or more. The paper's own axes under 6.5 1/s come to 1.27."""

SLOWEST = 0.05
"""Attitude gains below this, 1/s, hold nothing."""

STEP = 0.9
"""Ratio of one gain tried to the one before."""


@dataclass(frozen=True, slots=True)
class Group:
    """Axes that belong together (0 roll, 1 pitch, 2 yaw): torque to rate, and rate error to torque."""

    axes: tuple[int, ...]
    plant: StateSpace
    controller: StateSpace


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnAircraft:
    """What a file says of an aircraft. `attitude_gain` is the rate asked for per attitude error of each axis, 1/s;
    None where it is to be found. `delay_samples` is its link's."""

    source: str
    groups: tuple[Group, ...]
    delay_samples: int
    attitude_gain: Vector | None = None

    @property
    def foreign(self) -> tuple[str, ...]:
        """Axes of which the file says nothing: the paper's fly in their place."""
        own = {i for group in self.groups for i in group.axes}
        return tuple(name for i, name in enumerate(AXES) if i not in own)

    def settled(self) -> "OwnAircraft":
        """The same with an attitude gain that holds it. Raises FlightFailedError when there is none."""
        return replace(self, attitude_gain=self._gain_that_holds())

    def _gain_that_holds(self) -> Vector:
        whole = _whole(self)
        rate = _rate_loop(*whole)
        for group in _all_groups(self):
            _require_stable(group, self.source)
        gain = self.attitude_gain or _attitude_gain(rate)
        if gain is None or _radius(_attitude_loop(rate, gain)) >= 1.0:
            what = "no attitude loop" if gain is None else f"no attitude loop with the gains {list(gain)} 1/s"
            raise FlightFailedError(f"{self.source}: {what} holds this aircraft; expected a rate loop that follows")
        return gain

    def build(self) -> Aircraft:
        """A new aircraft of this kind, on the ground. Raises FlightFailedError as `settled` does."""
        gain = self.attitude_gain or self._gain_that_holds()
        groups = _all_groups(self)
        return Aircraft(
            airframe=LinearAirframe(rates=CoupledRates(beside([(g.axes, g.plant) for g in groups]))),
            mixer=SeparateAxes(),
            tuning=Tuning(rate=RATE_PIDS, hover_thrust=HOVER_THRUST),
            rates=MatrixLaw([(g.axes, g.controller) for g in groups]),
            attitude_gain=gain,
        )


def pid(gains: RateGains) -> StateSpace:
    """A `RateController` below saturation: p + i / (z − 1) + d / z."""
    z1, z2 = gains.zeros
    p, i, d = gains.gain, gains.gain * (1.0 - z1) * (1.0 - z2), -gains.gain * z1 * z2
    return StateSpace(np.diag([1.0, 0.0]), np.ones((2, 1)), np.array([[i, d]]), np.array([[p]]))


def _all_groups(own: OwnAircraft) -> list[Group]:
    """The file's, and the paper's axes for what it leaves out."""
    paper = [
        Group((i,), StateSpace.of((ROLL, PITCH, YAW)[i]), pid(RATE_PIDS[i])) for i in range(3) if AXES[i] in own.foreign
    ]
    return [*own.groups, *paper]


def _whole(own: OwnAircraft) -> tuple[StateSpace, StateSpace]:
    groups = _all_groups(own)
    return beside([(g.axes, g.plant) for g in groups]), beside([(g.axes, g.controller) for g in groups])


def _rate_loop(plant: StateSpace, controller: StateSpace) -> StateSpace:
    """Setpoint to rate, u = C (r − y), y = G u; G without feedthrough."""
    A = np.block(
        [
            [plant.A - plant.B @ controller.D @ plant.C, plant.B @ controller.C],
            [-controller.B @ plant.C, controller.A],
        ]
    )
    B = np.vstack([plant.B @ controller.D, controller.B])
    C = np.hstack([plant.C, np.zeros((len(plant.C), len(controller.A)))])
    return StateSpace(A, B, C, np.zeros((len(C), B.shape[1])))


def _require_stable(group: Group, source: str) -> None:
    radius = _radius(_rate_loop(group.plant, group.controller).A)
    if radius >= 1.0:
        names = ", ".join(AXES[i] for i in group.axes)
        raise FlightFailedError(
            f"{source}: {names}: the rate loop without an observer is unstable (a pole at |z| = {radius:.6g}); "
            "expected a controller that holds the plant"
        )


def _attitude_loop(rate: StateSpace, gain: Vector) -> Array:
    """A of rate loop and attitude together, r = −gain · angle, the angle turned by the mean of two rates."""
    turn = 0.5 * DT * (rate.C + rate.C @ rate.A)
    K = np.diag(gain)
    return np.block([[rate.A, -rate.B @ K], [turn, np.eye(3) - 0.5 * DT * rate.C @ rate.B @ K]])


def _attitude_gain(rate: StateSpace) -> Vector | None:
    """Of each axis the fastest up to ATTITUDE_GAIN that keeps to SENSITIVITY; all slower where they couple too much."""
    z = np.exp(1j * np.append(np.geomspace(1e-4, 1.0, 400), np.linspace(1.0, pi, 200, endpoint=False)[1:]))
    angle = 0.5 * DT * (z + 1.0) / (z - 1.0)
    n = len(rate.A)
    T = np.array([rate.C @ np.linalg.solve(each * np.eye(n) - rate.A, rate.B) for each in z])
    fastest = [_fastest(angle * T[:, i, i]) for i in range(3)]
    gains = np.array(fastest)
    while gains.min() >= SLOWEST and _radius(_attitude_loop(rate, _vector(gains))) >= 1.0:
        gains *= STEP
    return _vector(gains) if gains.min() >= SLOWEST else None


def _fastest(loop: NDArray[np.complex128]) -> float:
    gain = ATTITUDE_GAIN
    while gain >= SLOWEST and np.max(1.0 / np.abs(1.0 + gain * loop)) > SENSITIVITY:
        gain *= STEP
    return gain


def _vector(gains: Array) -> Vector:
    roll, pitch, yaw = gains.tolist()
    return roll, pitch, yaw


def _radius(A: Array) -> float:
    return float(np.max(np.abs(np.linalg.eigvals(A)), initial=0.0))
