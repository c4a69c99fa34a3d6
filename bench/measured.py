"""The rounds of a row, and what they come to."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from bench.row import Goal, Pair


@dataclass(frozen=True, slots=True)
class Measured:
    """What a child said of its row (bench/child.py), its rounds, and the share of the machine that others took."""

    row: dict[str, Any]
    pairs: tuple[Pair, ...]
    others: float

    @property
    def goal(self) -> Goal:
        """What is wanted."""
        return Goal(**self.row["goal"])

    @property
    def ours(self) -> float:
        """The median of Waydrop's values."""
        return statistics.median(pair.ours for pair in self.pairs)

    @property
    def floor(self) -> float:
        """The median of the floor's."""
        return statistics.median(pair.floor for pair in self.pairs)

    @property
    def ratios(self) -> list[float]:
        """Of each round, in order of size."""
        return sorted(pair.ours / pair.floor for pair in self.pairs)

    @property
    def ratio(self) -> float:
        """Their median."""
        return statistics.median(self.ratios)

    @property
    def is_met(self) -> bool:
        """Whether the goal is."""
        return self.goal.is_met(self.ours, self.ratio)

    def as_json(self) -> dict[str, Any]:
        """Everything, the rounds too."""
        summary = {
            "ours": self.ours,
            "floor_value": self.floor,
            "ratio": self.ratio,
            "ratio_min": self.ratios[0],
            "ratio_max": self.ratios[-1],
            "is_met": self.is_met,
            "others": self.others,
        }
        return self.row | summary | {"pairs": [asdict(pair) for pair in self.pairs]}

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Measured:
        """What `as_json` wrote."""
        pairs = tuple(Pair(**pair) for pair in data["pairs"])
        return cls({name: data[name] for name in ROW_FIELDS}, pairs, data["others"])


ROW_FIELDS = ("name", "title", "floor", "unit", "limited_by", "version", "goal", "rounds")


def spread(values: Sequence[float]) -> float:
    """The distance between the quartiles, as a share of the median."""
    low, middle, high = statistics.quantiles(values, n=4)
    return (high - low) / middle
