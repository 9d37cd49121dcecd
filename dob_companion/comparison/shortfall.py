"""How far a design is from the least attitude error there is, and what costs the rest: one thing changed at a time."""

from dataclasses import dataclass
from typing import Any

import control as ct

from dob_companion.artifact import DobBlock, StateSpaceData
from dob_companion.comparison.at_price import AtPrice
from dob_companion.comparison.flight import DISTURBANCE_HZ, NOISE_SIGMA, expect
from dob_companion.comparison.kalman import kalman
from dob_companion.comparison.lqg import lqg_attitude_bound
from dob_companion.comparison.measure import LoopResponses, delay_margin
from dob_companion.comparison.vehicle import Vehicle, close, no_observer
from dob_companion.errors import NotCertifiedError
from dob_companion.synthesis import synthesize

LEAST_BACKOFF = 1.0001
"""As near to gamma* as a certificate can tell apart."""

NO_LINK = "best at this price, no link delay"


@dataclass(frozen=True, slots=True)
class Step:
    """What would be had if one thing were different.

    attenuation    expected RMS attitude error off / on
    disk_margin, noise, delay_margin   what that costs, None where nothing that could fly stands behind it; noise is the
                   RMS of the correction that gyro noise alone causes, normalized torque
    """

    name: str
    attenuation: float
    disk_margin: float | None = None
    noise: float | None = None
    delay_margin: int | None = None


@dataclass(frozen=True, slots=True)
class Shortfall:
    """One axis of a design.

    off        RMS attitude error without observer, rad
    design     the observer as it is
    at_price   LQG-optimal among all observers of no smaller a disk margin and no more noise
    bound      LQG-optimal at any price (`lqg_attitude_bound`)
    steps      what single changes would bring
    """

    off: float
    design: Step
    at_price: Step
    bound: Step
    steps: tuple[Step, ...]

    @property
    def excess(self) -> float:
        """RMS attitude error beyond the best at its price, as a share of that."""
        return self.at_price.attenuation / self.design.attenuation - 1.0


def shortfall(block: DobBlock, dt: float, scale: float) -> Shortfall:
    """Of a block of one axis, its disturbance of sigma `scale` (normalized torque).

    Raises ValueError when the attitude loop is unstable without observer or with it, or the plant has a direct term.
    """
    posed = block.problem
    plant, controller, W_d, W_n = (
        _system(data, dt) for data in (posed.plant, posed.controller, posed.disturbance_weight, posed.noise_weight)
    )
    vehicle, direct = (Vehicle(plant, controller, delay) for delay in (block.delay_samples, 0))
    calm = expect(close(vehicle, no_observer(dt)), scale)
    if calm is None:
        raise ValueError("the attitude loop is unstable without observer")
    off = calm.attitude

    def flown(name: str, on: Vehicle, observer: Any) -> Step:
        found = expect(close(on, observer), scale)
        if found is None:
            raise ValueError(f"{name}: the attitude loop is unstable")
        margin = LoopResponses(on).disk_margin(observer)
        return Step(name, off / found.attitude, margin, found.noise_in_correction, delay_margin(on, observer))

    def nearer(backoff: float) -> list[Step]:
        try:
            again = synthesize(plant, controller, W_d, W_n, delay_samples=vehicle.delay, gamma_backoff=backoff)
        except NotCertifiedError:
            return []
        return [flown(f"back-off {backoff:g}", vehicle, again.observer)]

    ready = AtPrice(vehicle, scale)

    def best(name: str, margin: float | None, noise: float | None) -> Step:
        return flown(name, vehicle, ready.best(margin, noise))

    design = flown("this design", vehicle, _system(block.observer, dt))
    told = kalman(plant, vehicle.delay, DISTURBANCE_HZ, scale, NOISE_SIGMA)
    steps = [
        *nearer(LEAST_BACKOFF),
        best("best with any noise", design.disk_margin, None),
        best("best with any disk margin", None, design.noise),
        flown("Kalman filter told the spectrum", vehicle, told),
    ]
    if vehicle.delay:
        without = AtPrice(direct, scale).best(design.disk_margin, design.noise)
        steps.append(flown(NO_LINK, direct, without))
        steps.append(Step("LQG bound without link delay", off / lqg_attitude_bound(direct, scale)))
    return Shortfall(
        off=off,
        design=design,
        at_price=best("best at this price", design.disk_margin, design.noise),
        bound=Step("LQG bound, any price", off / lqg_attitude_bound(vehicle, scale)),
        steps=tuple(steps),
    )


def shortfall_table(found: Shortfall) -> list[str]:
    """Lines of aligned text, attenuation first."""
    rows = [("LQG-optimal", "attenuation", "n→d̂ RMS", "disk", "delay")]
    for step in (found.design, found.at_price, found.bound, *found.steps):
        cells = (
            f"{step.attenuation:.2f}",
            "–" if step.noise is None else f"{step.noise:.2e}".replace("e-0", "e−"),
            "–" if step.disk_margin is None else f"{step.disk_margin:.3f}",
            "–" if step.delay_margin is None else str(step.delay_margin),
        )
        rows.append((step.name, *cells))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    table = ["  ".join([name.ljust(widths[0]), *map(str.rjust, cells, widths[1:])]) for name, *cells in rows]
    return [*table, f"RMS attitude error {100.0 * found.excess:.0f} % above the best at its price"]


def _system(data: StateSpaceData, dt: float) -> Any:
    return ct.ss(data.A, data.B, data.C, data.D, dt)
