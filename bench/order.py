"""Time of a whole synthesis against the order of the problem, up to 40 states, and how it grows."""

import time
from collections.abc import Iterator
from statistics import median

import numpy as np

from bench._plants import W_D, W_N, static
from dob_companion.synthesis import synthesize
from tests.synthesis.problems import random_plant

PLANT_ORDERS = (2, 4, 8, 12, 18, 26, 38)
RUNS = 3


def measure() -> Iterator[str]:
    """A line per order (plant, disturbance and noise weight together), and the fitted exponent."""
    orders, seconds = [], []
    yield f"{'states':>6} {'order':>6} {'median s':>9}"
    for n in PLANT_ORDERS:
        took, order = [], 0
        for seed in range(RUNS):
            plant = random_plant(np.random.default_rng(seed), n, 1, 1)
            began = time.perf_counter()
            order = synthesize(plant, static(0.0), W_D, W_N).observer.nstates
            took.append(time.perf_counter() - began)
        orders.append(n + 2)
        seconds.append(median(took))
        yield f"{n + 2:>6} {order:>6} {seconds[-1]:>9.3f}"
    late = len(orders) // 2
    slope = np.polyfit(np.log(orders[late:]), np.log(seconds[late:]), 1)[0]
    yield f"from {orders[late]} states on, time grows as the order to the power of {slope:.1f}"
