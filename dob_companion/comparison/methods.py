"""The methods that are compared: each with its source, and the forms and settings that it is searched over."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from dob_companion.comparison.conventional import INVERSES, conventional
from dob_companion.comparison.eso import extended_state_observer, integrator_chain_observer
from dob_companion.comparison.flight import DISTURBANCE_HZ, NOISE_SIGMA
from dob_companion.comparison.indi import indi
from dob_companion.comparison.kalman import kalman
from dob_companion.comparison.open_loop import open_loop_hinf, polynomials
from dob_companion.comparison.rational import low_passed
from dob_companion.comparison.tuning import Family, Knob
from dob_companion.comparison.vehicle import Vehicle

NYQUIST_SHARE = 0.8
"""Bandwidths are searched up to this share of half the rate."""

LEAST_HZ = 0.1


@dataclass(frozen=True, slots=True)
class Method:
    """A method that is tuned by the common rule over `families`."""

    key: str
    name: str
    source: str
    families: tuple[Family, ...]


@dataclass(frozen=True, slots=True)
class Stated:
    """An observer taken as its source states it, held to no rule; `build` may raise NotApplicableError."""

    key: str
    name: str
    source: str
    settings: str
    build: Callable[[], Any]


SOURCES = {
    "off": "",
    "hinf": "this project, after the paper",
    "conventional": "Ohnishi 1987, Umeno and Hori 1991; inverses: Tomizuka 1987, Butterworth et al. 2008",
    "open_loop": "Seo, Kim and Kim 2013, the paper's [10]",
    "kalman": "Anderson and Moore 1979; Li et al. 2024",
    "eso": "Gao 2003; Miklosovic, Radke and Gao 2006",
    "indi": "Smeur, Chu and de Croon 2016",
}
"""Short citations; the full ones open the files of the methods."""


def methods(vehicle: Vehicle, weight: Any, scale: float) -> tuple[Method, ...]:
    """What is tuned for a vehicle: `weight` is the spec's W_d, `scale` the disturbance's sigma (normalized torque)."""
    plant, delay = vehicle.plant, vehicle.delay
    most_hz = NYQUIST_SHARE * 0.5 / vehicle.dt

    def bandwidth(name: str, points: int = 25) -> Knob:
        return Knob(name, "Hz", LEAST_HZ, most_hz, points)

    def filtered(order: int, hertz: float) -> Any:
        return low_passed(open_loop_hinf(plant, delay, polynomials(weight)), order, hertz)

    def distrusting(factor: float, hertz: float) -> Any:
        return kalman(plant, delay, hertz, scale, factor * NOISE_SIGMA)

    return (
        Method(
            "conventional",
            "conventional DOB",
            SOURCES["conventional"],
            tuple(
                Family(
                    f"{inverse}, Butterworth {order}", (bandwidth("Q"),), partial(conventional, plant, inverse, order)
                )
                for inverse in INVERSES
                for order in (1, 2, 3, 4)
            ),
        ),
        Method(
            "open_loop",
            "open-loop H∞, low-passed",
            SOURCES["open_loop"],
            tuple(
                Family(f"Butterworth {order}", (bandwidth("low-pass"),), partial(filtered, order))
                for order in (1, 2, 3, 4)
            ),
        ),
        Method(
            "kalman",
            "Kalman filter",
            SOURCES["kalman"],
            (
                Family(
                    "",
                    (Knob("noise ×", "", 0.1, 1e3, 9), Knob("disturbance", "Hz", 1e-3, 10.0 * DISTURBANCE_HZ, 9)),
                    distrusting,
                ),
            ),
        ),
        Method(
            "eso",
            "extended-state observer",
            SOURCES["eso"],
            (
                Family("with the model", (bandwidth("ω₀ / 2π"),), partial(extended_state_observer, plant, delay)),
                Family("integrators", (bandwidth("ω₀ / 2π"),), partial(integrator_chain_observer, plant, delay)),
            ),
        ),
        Method("indi", "INDI", SOURCES["indi"], (Family("", (bandwidth("H"),), partial(indi, plant)),)),
    )


def stated(vehicle: Vehicle, weight: Any, scale: float) -> tuple[Stated, ...]:
    """What two sources would fly without the rule."""
    plant, delay = vehicle.plant, vehicle.delay
    return (
        Stated(
            "kalman_told",
            "Kalman filter, told the truth",
            SOURCES["kalman"],
            f"disturbance {DISTURBANCE_HZ:g} Hz, noise as flown",
            lambda: kalman(plant, delay, DISTURBANCE_HZ, scale, NOISE_SIGMA),
        ),
        Stated(
            "open_loop_stated",
            "open-loop H∞, as stated",
            SOURCES["open_loop"],
            "W_d of the spec",
            lambda: open_loop_hinf(plant, delay, polynomials(weight)),
        ),
    )
