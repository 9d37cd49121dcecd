"""Whether the observer problem has a solution, asked before solving; each refusal names axis, mode and physics."""

from typing import Any

import numpy as np

from dob_companion.errors import SpecError, UnsolvableError
from dob_companion.lti.response import response
from dob_companion.synthesis.plant.loop import close_loop
from dob_companion.synthesis.plant.minimal import hidden_modes
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.spec.limits import LONGEST_DELAY, MOST_STATES
from dob_companion.toml import shown

FASTEST_GROWTH = 2.0
"""A plant mode that more than doubles within one sample cannot be held by a loop of that rate."""

ON_CIRCLE = 1e-9
"""Distance from the unit circle below which a mode counts as undamped."""


def require_solvable(problem: Problem, axes: tuple[str, ...] | None = None) -> None:
    """Raise SpecError for systems that do not fit together, UnsolvableError for a problem without solution."""
    _require_sizes(problem)
    names = axes or tuple(f"input {i + 1}" for i in range(problem.plant.D.shape[1]))
    _require_carried(problem, names)
    _require_seen(problem)
    _require_weights(problem)
    _require_stable_baseline(problem, names)


def require_sampled_fast_enough(system: Any, dt: float, where: str) -> None:
    """Refuse a continuous model whose modes turn or grow faster than the rate 1/dt can show."""
    for pole in system.poles():
        if abs(pole.imag) >= np.pi / dt:
            raise UnsolvableError(
                f"{where}: mode at {abs(pole.imag) / 2 / np.pi:.4g} Hz lies above half the rate, {0.5 / dt:.4g} Hz"
            )
        if pole.real * dt > np.log(FASTEST_GROWTH):
            raise UnsolvableError(
                f"{where}: unstable pole s = {pole.real:.4g} 1/s grows {np.exp(pole.real * dt):.3g}-fold a sample; "
                f"a rate of {1 / dt:.4g} Hz cannot hold more than {FASTEST_GROWTH:g}"
            )


def describe(pole: complex, dt: float) -> str:
    """A discrete mode in the words of an engineer."""
    hertz = abs(np.angle(pole)) / (2.0 * np.pi * dt)
    size = abs(pole)
    if abs(size - 1.0) <= ON_CIRCLE:
        motion = "neither grows nor decays"
    else:
        motion = f"{'grows' if size > 1 else 'decays'} by a factor {size:.6g} a sample"
    root = f"{pole.real:.6g}" if abs(pole.imag) < 1e-12 else f"{pole.real:.6g}±{abs(pole.imag):.6g}j"
    return f"mode z = {root} ({hertz:.4g} Hz, {motion})"


def _require_sizes(problem: Problem) -> None:
    p, m = problem.plant.D.shape
    systems = {
        "controller": (problem.controller, (m, p)),
        "disturbance weight": (problem.disturbance_weight, (m, problem.disturbance_weight.D.shape[1])),
        "noise weight": (problem.noise_weight, (p, problem.noise_weight.D.shape[1])),
    }
    for name, (system, shape) in systems.items():
        if system.D.shape != shape:
            raise SpecError(f"{name}: {system.D.shape[0]}x{system.D.shape[1]}, expected {shape[0]}x{shape[1]}")
        if system.dt != problem.plant.dt:
            raise SpecError(f"{name}: dt is {system.dt}, expected the plant's {problem.plant.dt}")
    if not isinstance(problem.plant.dt, float) or problem.plant.dt <= 0.0:
        raise SpecError(f"plant: dt is {problem.plant.dt}, expected a sample time in s")
    if len(problem.delays) != m or not 0 <= min(problem.delays) <= max(problem.delays) <= LONGEST_DELAY:
        raise SpecError(
            f"delay_samples: {shown(list(problem.delays))}, expected {m} of 0 or more, at most {LONGEST_DELAY}"
        )
    _require_orders(problem)


def _require_orders(problem: Problem) -> None:
    """Refuse what would take hours and all memory."""
    parts = (problem.plant, problem.disturbance_weight, problem.noise_weight)
    orders, late = [part.nstates for part in parts], sum(problem.delays)
    if sum(orders) + late > MOST_STATES:
        raise SpecError(
            f"plant and weights of {' + '.join(map(str, orders))} states and {late} samples of delay have order "
            f"{sum(orders) + late} together, expected at most {MOST_STATES}"
        )
    if problem.controller.nstates > MOST_STATES:
        raise SpecError(f"controller: {problem.controller.nstates} states, expected at most {MOST_STATES}")


def _require_carried(problem: Problem, names: tuple[str, ...]) -> None:
    poles = np.linalg.eigvals(problem.plant.A)
    fast = poles[np.abs(poles) > FASTEST_GROWTH]
    if fast.size:
        worst = complex(fast[np.argmax(np.abs(fast))])
        raise UnsolvableError(
            f"plant of {', '.join(names)}: {describe(worst, problem.dt)} is outside what the rate can carry: "
            f"expected poles within {FASTEST_GROWTH:g}"
        )


def _require_seen(problem: Problem) -> None:
    for name, system in (("plant", problem.plant), ("controller", problem.controller)):
        for pole in hidden_modes(system):
            if abs(pole) >= 1.0 - ON_CIRCLE:
                raise UnsolvableError(
                    f"{name}: {describe(complex(pole), problem.dt)} cannot be reached from its input or seen in its "
                    "output: no loop can hold it"
                )


def _require_weights(problem: Problem) -> None:
    if not np.any(response(problem.disturbance_weight, np.array([0.1, 1.0, 2.0]))):
        raise UnsolvableError("disturbance weight: zero at every frequency: there is nothing to estimate")
    for name, weight in (("disturbance", problem.disturbance_weight), ("noise", problem.noise_weight)):
        poles = np.linalg.eigvals(weight.A) if weight.nstates else np.zeros(0)
        if np.any(np.abs(poles) >= 1.0):
            worst = complex(poles[np.argmax(np.abs(poles))])
            raise UnsolvableError(
                f"{name} weight: {describe(worst, problem.dt)} is not stable: "
                "a weight must be bounded at every frequency; move the pole just inside the unit circle"
            )


def _require_stable_baseline(problem: Problem, names: tuple[str, ...]) -> None:
    if abs(np.linalg.det(np.eye(len(problem.plant.D)) + problem.plant.D @ problem.controller.D)) < 1e-12:
        raise UnsolvableError("baseline loop: plant and controller both answer at once and 1 + G C is singular")
    loop = close_loop(problem.plant, problem.controller, None, problem.delays)
    poles, modes = np.linalg.eig(loop.system.A)
    worst = int(np.argmax(np.abs(poles), axis=0)) if poles.size else -1
    if worst < 0 or abs(poles[worst]) < 1.0 - ON_CIRCLE:
        return
    shown = np.abs(loop.part("y", "d").C @ modes[:, worst])
    where = f" of {names[int(np.argmax(shown))]}" if len(shown) == len(names) else ""
    raise UnsolvableError(
        f"baseline loop{where} (controller and plant, observer off) is not stable: "
        f"{describe(complex(poles[worst]), problem.dt)}; an observer cannot repair it: "
        "check the signs of u = C (r - y_n) and the gain"
    )
