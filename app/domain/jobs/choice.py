"""Chooses among the vehicles that can: the nearest, then the one with most battery, then by id. Always the same."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from app.domain.jobs.candidate import Candidate
from app.domain.reason import ReasonCode, because

NEAR_M: Final = 10.0
"""Who is at most this much farther than the nearest is as near: vehicles of one place are told apart by battery."""

TOLD: Final = 5
"""Vehicles that a warning names; the candidates have them all."""


def choose(candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """The candidates in the order of their ids, at most one of them chosen, each that can with a reason."""
    able = [one for one in candidates if one.can]
    best = _best(able) if able else None
    listed = (one if not one.can or best is None else _told(one, best, alone=len(able) == 1) for one in candidates)
    return tuple(sorted(listed, key=lambda one: by_number(one.vehicle_id)))


def chosen_of(candidates: Sequence[Candidate]) -> Candidate | None:
    """The one that was chosen."""
    return next((one for one in candidates if one.chosen), None)


def hopeless(candidates: Sequence[Candidate]) -> str:
    """Why waiting alone gives the job to none of these vehicles; empty if it may, or if there are none."""
    if not candidates or not all(one.lasting for one in candidates):
        return ""
    told = [f"{one.vehicle_id}: {_lasting(one)}" for one in candidates[:TOLD]]
    others = [f"and {len(candidates) - TOLD} more"] if len(candidates) > TOLD else []
    return f"no vehicle can fly it as it is, and waiting does not change that ({'; '.join([*told, *others])})"


def by_number(vehicle_id: str) -> tuple[int, str]:
    """v2 before v10."""
    return len(vehicle_id), vehicle_id


def _best(able: Sequence[Candidate]) -> Candidate:
    nearest_m = min(_metres(one) for one in able)
    near = [one for one in able if _metres(one) <= nearest_m + NEAR_M]
    return min(near, key=lambda one: (-_percent(one), by_number(one.vehicle_id)))


def _told(one: Candidate, best: Candidate, *, alone: bool) -> Candidate:
    if one is best:
        why = because(ReasonCode.ONLY_CANDIDATE if alone else ReasonCode.CHOSEN)
        return one.model_copy(update={"chosen": True, "reason": why})
    return one.model_copy(update={"reason": because(ReasonCode.ANOTHER_CHOSEN, vehicle_id=best.vehicle_id)})


def _lasting(one: Candidate) -> str:
    return next((refusal.message for refusal in one.refusals if refusal.lasting), "see its refusals")


def _metres(one: Candidate) -> float:
    return math.inf if one.distance_m is None else one.distance_m


def _percent(one: Candidate) -> float:
    return -1.0 if one.battery_percent is None else one.battery_percent
