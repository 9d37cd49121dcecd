"""The axes in which a vehicle speaks, where they are not those of hover: signed permutations of determinant +1.

Everything else in this program is in hover axes (docs/interfaces.md, "Axes, signs, units"). What a vehicle says is
turned as it is read, and a correction as it is written, here and nowhere else.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations, product

from dob_companion.mavlink.facts import AppliedMoment, Axes3, CorrectionHeard, Fact, GyroSample

NAMES = ("roll", "pitch", "yaw")


@dataclass(frozen=True, slots=True)
class AxisMap:
    """Roll, pitch and yaw of hover in terms of the vehicle's: axis i is that of index `of[i]`, negated where
    `negated[i]`. A rotation by quarter turns. Raises ValueError, in words, for what is none."""

    of: tuple[int, int, int] = (0, 1, 2)
    negated: tuple[bool, bool, bool] = (False, False, False)

    def __post_init__(self) -> None:
        if sorted(self.of) != [0, 1, 2]:
            raise ValueError(f"expected 0, 1, 2 in any order, got {self.of}")
        odd = sum(self.of[i] > self.of[j] for i in range(3) for j in range(i + 1, 3)) % 2
        if (odd + sum(self.negated)) % 2:
            raise ValueError(f"expected a rotation, of determinant +1; {self} has -1: change one sign")

    @property
    def words(self) -> list[str]:
        """The names, as the configuration has them."""
        return ["-" * minus + NAMES[i] for i, minus in zip(self.of, self.negated, strict=True)]

    def __str__(self) -> str:
        return json.dumps(self.words)  # which is TOML as well

    def inward(self, vehicle: Axes3) -> Axes3:
        """A vector of the vehicle's axes in those of hover, exactly; a zero stays a positive zero."""
        (i, j, k), (a, b, c) = self.of, self.negated
        x, y, z = vehicle[i], vehicle[j], vehicle[k]
        return (0.0 - x if a else x), (0.0 - y if b else y), (0.0 - z if c else z)

    def outward(self, hover: Axes3) -> Axes3:
        """The inverse of `inward`."""
        return self.inverse.inward(hover)

    @property
    def inverse(self) -> "AxisMap":
        """The rotation back."""
        i, j, k = (self.of.index(axis) for axis in range(3))
        return AxisMap((i, j, k), (self.negated[i], self.negated[j], self.negated[k]))

    def after(self, first: "AxisMap") -> "AxisMap":
        """The map that turns by `first` and then by this one."""
        i, j, k = self.of
        a, b, c = (own != first.negated[at] for at, own in zip(self.of, self.negated, strict=True))
        return AxisMap((first.of[i], first.of[j], first.of[k]), (a, b, c))


def axis_map(names: Sequence[str]) -> AxisMap:
    """From the configuration's words, such as "yaw", "pitch", "-roll". Raises ValueError, in words."""
    bare = [name.removeprefix("-") for name in names]
    if sorted(bare) != sorted(NAMES):
        raise ValueError(f'expected each of roll, pitch, yaw once, negated as "-roll", got {list(names)}')
    i, j, k = map(NAMES.index, bare)
    a, b, c = (name.startswith("-") for name in names)
    return AxisMap((i, j, k), (a, b, c))


HOVER = AxisMap()
"""What a vehicle speaks in unless the configuration says otherwise."""


def _rotations() -> tuple[AxisMap, ...]:
    found = []
    for (i, j, k), (a, b, c) in product(permutations(range(3)), product((False, True), repeat=3)):
        try:
            found.append(AxisMap((i, j, k), (a, b, c)))
        except ValueError:
            continue
    return tuple(found)


ROTATIONS = _rotations()
"""All 24, HOVER first."""


@dataclass(frozen=True, slots=True)
class VehicleAxes:
    """In which axes the vehicle measures its rates, and in which it reports moments and takes corrections."""

    gyro: AxisMap = HOVER
    moment: AxisMap = HOVER

    def __str__(self) -> str:
        """As the configuration has them; "" where both are hover's."""
        named = (("gyro", self.gyro), ("moment", self.moment))
        return ", ".join(f"{name} = {each}" for name, each in named if each != HOVER)

    def inward(self, fact: Fact) -> Fact:
        """What the vehicle says, in hover axes."""
        match fact:
            case GyroSample(stamp_us, rates) if self.gyro != HOVER:
                return GyroSample(stamp_us, self.gyro.inward(rates))
            case AppliedMoment() if self.moment != HOVER:
                turn = self.moment.inward
                return replace(fact, moment=turn(fact.moment), correction=turn(fact.correction))
            case CorrectionHeard() if self.moment != HOVER:
                return replace(fact, correction=self.moment.inward(fact.correction))
        return fact

    def outward(self, correction: Axes3) -> Axes3:
        """A correction as the vehicle takes it."""
        return correction if self.moment == HOVER else self.moment.outward(correction)


IN_HOVER = VehicleAxes()
