"""A row of `make bench`: what Waydrop takes for one kind of work, beside the floor, measured in turns in one run.

A module of bench/rows has one row or a few. Its rounds are measured in a process of its own (bench/child.py), so that
two commits can be measured in turns (bench/compare.py).
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Pair:
    """One round: Waydrop and the floor, one right after the other, in the row's unit."""

    ours: float
    floor: float


Round = Callable[[], Awaitable[Pair]]


@dataclass(frozen=True, slots=True)
class Scale:
    """How much is measured: `long` is for a machine that has nothing else to do."""

    long: bool = False


@dataclass(frozen=True, slots=True)
class Goal:
    """A bound on the ratio of Waydrop to the floor, or on Waydrop's own value.

    "either": on the value; where the machine is so busy that not even the floor keeps it, on the ratio.
    """

    bound: float
    sense: Literal["at most", "at least"]
    of: Literal["ratio", "value", "either"] = "ratio"

    def is_met(self, value: float, ratio: float) -> bool:
        """Whether the medians keep to it."""
        found = {"ratio": (ratio,), "value": (value,), "either": (value, ratio)}[self.of]
        return any(one <= self.bound if self.sense == "at most" else one >= self.bound for one in found)


@dataclass(frozen=True, slots=True)
class Row:
    """`prepare` sets up what all rounds share. `version` changes with what is measured: two of them do not compare.

    `limited_by` says, for docs/reference/performance.md, where the time goes.
    """

    name: str
    title: str
    floor: str
    unit: str
    goal: Goal
    prepare: Callable[[Scale], AbstractAsyncContextManager[Round]]
    limited_by: str
    rounds: int = 7
    long_rounds: int = 21
    version: int = 1

    def rounds_of(self, scale: Scale) -> int:
        """How many."""
        return self.long_rounds if scale.long else self.rounds
