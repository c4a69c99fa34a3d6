"""Whether a measure rises: its slope, with the interval that noise leaves it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

BLOCKS: Final = 12
T_975: Final = 2.228
"""Student's t for 95 % on both sides, with BLOCKS - 2 degrees of freedom."""


@dataclass(frozen=True)
class Slope:
    """Per hour, and half the width of its 95 % interval."""

    first: float
    last: float
    per_hour: float
    margin: float
    hours: float

    @property
    def least_rise(self) -> float:
        """What is sure of the rise over the time measured."""
        return (self.per_hour - self.margin) * self.hours


def slope_of(samples: Sequence[tuple[float, float]]) -> Slope:
    """The straight line through the means of BLOCKS equal blocks of (seconds, value).

    Neighbouring samples are alike, so they are no independent measurements; means of long blocks nearly are.
    """
    size = len(samples) // BLOCKS
    assert size > 0, f"{len(samples)} samples are fewer than {BLOCKS} blocks"
    blocks = [samples[number * size : (number + 1) * size] for number in range(BLOCKS)]
    hours = [sum(at_s for at_s, _ in block) / size / 3600.0 for block in blocks]
    means = [sum(value for _, value in block) / size for block in blocks]
    middle_h, mean = sum(hours) / BLOCKS, sum(means) / BLOCKS
    spread = sum((hour - middle_h) ** 2 for hour in hours)
    per_hour = sum((hour - middle_h) * (value - mean) for hour, value in zip(hours, means, strict=True)) / spread
    left = [value - mean - per_hour * (hour - middle_h) for hour, value in zip(hours, means, strict=True)]
    margin = T_975 * math.sqrt(sum(one**2 for one in left) / (BLOCKS - 2) / spread)
    return Slope(means[0], means[-1], per_hour, margin, hours[-1] - hours[0])
