"""What becomes of samples and answers on the link: lost, late, or late by turns. Pure.

In lockstep all of it is deterministic: what becomes of a sample's pair and of its answer is drawn when the sample is
flown, by seed, and an answer's time is counted in vehicle time.
"""

from dataclasses import dataclass

import numpy as np

from sitl.attitude import Vector
from sitl.constants import DT_US

STREAM = 2
"""Distinguishes this generator from the others of the same seed and segment."""

MEMORY = 256
"""Samples whose answers' fates are remembered; an answer to an older one is not touched."""


@dataclass(frozen=True, slots=True)
class Quality:
    """How a link behaves: shares lost (0…1), and samples that an answer is held back beyond the link's own delay.

    `jitter_samples` is the largest further delay; each answer's is drawn evenly from 0 to it, so answers can overtake
    one another.
    """

    pairs_lost: float = 0.0
    answers_lost: float = 0.0
    delay_samples: int = 0
    jitter_samples: int = 0


CLEAN = Quality()


class Channel:
    """Holds answers back and loses them. `delay_samples` is the least age at which a correction acts, 1 or more."""

    def __init__(self, seed: int, delay_samples: int = 1) -> None:
        self.quality = CLEAN
        self.pair_lost = False
        self._seed, self._least = seed, delay_samples - 1
        self._fates: dict[int, int | None] = {}
        self._under_way: list[tuple[int, int, Vector]] = []
        self.begin(0)

    def begin(self, stream: int) -> None:
        """Start the draws of a segment from its first sample, on a clean link; answers under way stay so."""
        self.quality = CLEAN
        self._draws = np.random.default_rng([self._seed, stream, STREAM])

    def sample(self, stamp_us: int) -> None:
        """Decide what becomes of the pair stamped `stamp_us` and of the answer to it."""
        quality = self.quality
        self.pair_lost = False
        hold: int | None = self._least + quality.delay_samples
        if quality is not CLEAN:
            pair, answer, late = self._draws.random(3).tolist()
            self.pair_lost = pair < quality.pairs_lost
            if answer < quality.answers_lost or self.pair_lost:
                hold = None
            elif hold is not None:
                hold += int(late * (quality.jitter_samples + 1))
        self._fates[stamp_us] = hold
        if len(self._fates) > MEMORY:
            del self._fates[next(iter(self._fates))]

    def take(self, stamp_us: int, value: Vector, now_us: int) -> bool:
        """An answer arrives at `now_us`; it is passed on by `due` later. False when the link loses it."""
        hold = self._fates.get(stamp_us, 0)
        if hold is None:
            return False
        self._under_way.append((now_us + hold * DT_US, stamp_us, value))
        return True

    def due(self, now_us: int) -> list[tuple[int, Vector]]:
        """Answers (stamp, correction) that have come through by `now_us`, in the order of their coming."""
        if not self._under_way:
            return []
        come = sorted(answer for answer in self._under_way if answer[0] <= now_us)
        self._under_way = [answer for answer in self._under_way if answer[0] > now_us]
        return [(stamp, value) for _, stamp, value in come]
