"""Which runs somebody wants to see."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.domain.run import RunState


@dataclass(frozen=True, slots=True)
class RunFilter:
    """Every condition that is given must hold; none: all runs.

    `states` empty is any state. Times are Unix seconds of the run's creation, `created_from` included and
    `created_before` not. `older_than` is the id of a run: only those stored before it, for the next page.
    """

    vehicle_id: str | None = None
    plan_id: str | None = None
    states: frozenset[RunState] = frozenset()
    open_only: bool = False
    created_from: float | None = None
    created_before: float | None = None
    older_than: str | None = None


ALL_RUNS: Final = RunFilter()
