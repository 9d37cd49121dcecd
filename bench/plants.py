"""The synthesizer on 28 plants, beside other people's solvers on the same problems, in one run.

`python -m bench plants` prints the tables; `make plants` writes them to docs/plants.md.
"""

import sys
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import control as ct
import cvxpy
import numpy as np

from bench._plants import Plant, all_plants
from dob_companion.lti.response import spectral_radius
from dob_companion.synthesis import synthesize
from dob_companion.synthesis.norms.hinf import hinf_norm
from dob_companion.synthesis.plant.estimation import estimation_problem
from dob_companion.synthesis.solve.lmi import solve_lmi
from dob_companion.synthesis.solve.scaling import whitened
from tests.synthesis.oracle import generalized_plant, to_continuous

PAGE = Path(__file__).parents[1] / "docs" / "plants.md"
RUNS = 3
TIGHT = 1.00001
"""Back-off beside the peers, which ask for the optimum itself."""
LARGEST_FOR_LMI_PEERS = 2
"""States of the plant above which the peers' LMIs take minutes and are left out."""

GIVING_UP = (ArithmeticError, RuntimeError, ValueError, cvxpy.error.SolverError)
"""What a peer raises when it has no observer; numpy's LinAlgError is a ValueError. Anything else is a fault of ours."""


@dataclass(frozen=True, slots=True, eq=False)
class Peer:
    """Somebody else's H-infinity synthesis: continuous generalized plant, measurements, controls -> controller."""

    name: str
    solve: Callable[[Any, int, int], Any]


def measure() -> Iterator[str]:
    """The lines of both tables."""
    warnings.simplefilter("ignore")
    plants = all_plants()
    yield from _ours(plants)
    yield ""
    yield from _against(plants)


def _ours(plants: list[Plant]) -> Iterator[str]:
    yield "| plant | kind | source | states | γ* | γ / γ* | order | command leak | disk margin | delay margin | s |"
    yield "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    for plant in plants:
        seconds, result = _timed(lambda plant=plant: synthesize(*plant.arguments, delay_samples=plant.delay))
        c = result.certificate
        yield (
            f"| {plant.name} | {plant.kind} | {plant.source} | {plant.plant.nstates} | {c.gamma_star:.6g} "
            f"| {c.gamma / c.gamma_star:.4f} | {result.observer.nstates} | {c.command_leak:.0e} | {c.disk_margin:.3f} "
            f"| {c.delay_margin_samples} | {seconds:.2f} |"
        )


def _against(plants: list[Plant]) -> Iterator[str]:
    peers = _peers()
    yield "| plant | ours, γ / γ* | ours, s | " + " | ".join(f"{p.name}, γ / γ* | s" for p in peers) + " |"
    yield "| --- | --- | --- |" + " --- | --- |" * len(peers)
    failures, ratios = dict.fromkeys((p.name for p in peers), 0), {p.name: [] for p in peers}
    lmi_ratios: dict[str, list[float]] = {p.name: [] for p in peers}
    compared = [p for p in plants if _gain(p) is not None]
    for plant in compared:
        seconds, result = _timed(
            lambda plant=plant: synthesize(*plant.arguments, delay_samples=plant.delay, gamma_backoff=TIGHT)
        )
        star = result.certificate.gamma_star
        cells = [f"{result.certificate.gamma / star:.4f} | {seconds:.2f}"]
        for peer in peers:
            if peer.name.startswith("dkpy") and plant.plant.nstates > LARGEST_FOR_LMI_PEERS:
                cells.append("– | –")
                continue
            took, gamma = _timed(lambda plant=plant, peer=peer: _achieved(peer, plant), runs=1)
            good = gamma is not None and gamma / star < 10
            failures[peer.name] += not good
            ratios[peer.name] += [seconds / took] if good else []
            if good and peer.name.startswith("dkpy"):
                lmi_ratios[peer.name].append(_lmi_seconds(plant) / took)
            cells.append(f"{gamma / star:.4f} | {took:.2f}" if good else f"fails | {took:.2f}")
        yield f"| {plant.name} | " + " | ".join(cells) + " |"
    yield ""
    yield f"{len(compared)} plants with a static stable baseline and no direct term, which the peers' form needs."
    for peer in peers:
        share = f"{median(ratios[peer.name]):.2f}" if ratios[peer.name] else "–"
        lmi = f", our LMI alone {median(lmi_ratios[peer.name]):.2f}" if lmi_ratios[peer.name] else ""
        yield f"{peer.name}: {failures[peer.name]} failures; our synthesis takes {share} of its time{lmi} (medians)."


def _lmi_seconds(plant: Plant) -> float:
    """Our LMI path without Riccati equation and certificate: pose, scale, solve."""
    m = plant.plant.D.shape[1]
    delays = (plant.delay,) * m if isinstance(plant.delay, int) else plant.delay

    def path() -> object:
        return solve_lmi(whitened(estimation_problem(plant.plant, plant.disturbance, plant.noise, delays)).problem)

    return _timed(path)[0]


def _peers() -> list[Peer]:
    peers = [Peer("SB10AD (slycot)", lambda P, y, u: ct.hinfsyn(P, y, u)[0])]
    try:
        import dkpy
    except ImportError:
        return peers
    return [
        *peers,
        Peer("dkpy LMI, bisection", lambda P, y, u: dkpy.HinfSynLmiBisection().synthesize(P, y, u)[0]),
        Peer("dkpy LMI", lambda P, y, u: dkpy.HinfSynLmi().synthesize(P, y, u)[0]),
    ]


def _achieved(peer: Peer, plant: Plant) -> float | None:
    """The norm that the peer's observer really has, (w_d, w_n) -> error; None when it gives none or an unstable one."""
    p, m = plant.plant.D.shape
    delays = (plant.delay,) * m if isinstance(plant.delay, int) else plant.delay
    P = generalized_plant(plant.plant, _gain(plant), plant.disturbance, plant.noise, delays)
    continuous = to_continuous(P)
    try:
        found = peer.solve(continuous, p + m, m)
    except GIVING_UP:
        return None
    if found is None:
        return None
    try:
        K = _to_discrete(found, P.dt)
    except np.linalg.LinAlgError:  # a pole at infinity
        return None
    closed = P.lft(K)
    exogenous = plant.disturbance.D.shape[1] + plant.noise.D.shape[1]
    closed = ct.ss(closed.A, closed.B[:, :exogenous], closed.C, closed.D[:, :exogenous], P.dt)
    if spectral_radius(closed.A) >= 1.0:
        return None
    return float(hinf_norm(closed)[0])


def _gain(plant: Plant) -> float | None:
    """A scalar static stabilizing gain, or None."""
    if np.any(plant.plant.D):
        return None
    if plant.controller is not None and "paper pitch" in plant.name and "mN" not in plant.name:
        return 0.05 if "flexible" in plant.name else 0.1
    C = plant.controller
    k = C.D[0, 0]
    return float(k) if C.nstates == 0 and np.allclose(C.D, k * np.eye(*C.D.shape)) else None


def _to_discrete(K: Any, dt: float) -> Any:
    n = K.nstates
    inverse = np.linalg.inv(np.eye(n) - K.A)
    root = np.sqrt(2.0)
    return ct.ss(inverse @ (np.eye(n) + K.A), root * inverse @ K.B, root * K.C @ inverse, K.D + K.C @ inverse @ K.B, dt)


def _timed(call: Callable[[], Any], runs: int = RUNS) -> tuple[float, Any]:
    """Median seconds of a few runs, and the result."""
    seconds = []
    for _ in range(runs):
        began = time.perf_counter()
        result = call()
        seconds.append(time.perf_counter() - began)
    return median(seconds), result


if __name__ == "__main__":
    text = "\n".join(measure())
    ours, _, against = text.partition("\n\n")
    PAGE.write_text(
        "# Plants\n\nWritten by `make plants`. Each observer is certified from its own matrices at a back-off of\n"
        "1.01: γ is measured, γ* a lower bound on which LMI and Riccati equation agree. Times are medians of three on\n"
        "a shared machine; compare ratios, not seconds. Plants are defined in `bench/_plants.py`.\n\n"
        f"{ours}\n\n## Beside other solvers\n\nThe same problems in the form that general H∞ synthesis needs (command "
        "channel of weight 1, static baseline,\nbilinear map); back-off 1.00001 on our side. γ is what each observer "
        f"measures, not what its solver reports.\n\n{against}\n",
        encoding="utf-8",
    )
    sys.stdout.write(text + "\n")
