"""Whether a vehicle can fly a plan, by the rules with its own parameters, and how far away from it it is."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Final

from app.domain.finding import Finding, Severity
from app.domain.geo import distance_m
from app.domain.jobs.candidate import Refusal
from app.domain.plan import Plan
from app.domain.vehicle import VehicleState

NOBODY_READS: Final = frozenset({"vehicle.home_differs"})
"""Warnings that a person who names a vehicle may judge. Where Waydrop chooses nobody would read them: they refuse."""


_PASSING: Final = frozenset({"vehicle.home_unknown", "vehicle.home_differs", "vehicle.clock_too_fast"})
"""What stands against a vehicle now and may be otherwise in a moment, or where it lands next."""


def why_unfit(findings: Iterable[Finding], *, we_choose: bool, at_best: Collection[str] = ()) -> tuple[Refusal, ...]:
    """The findings that stand against a vehicle.

    `at_best` are the codes of the errors that stay with a full battery where the plan begins: those are lasting.
    """
    return tuple(
        Refusal(
            code=found.code,
            message=found.message,
            hint=found.hint,
            pointer=found.pointer,
            lasting=found.code in at_best and found.code not in _PASSING,
        )
        for found in findings
        if found.severity is Severity.ERROR or (we_choose and found.code in NOBODY_READS)
    )


def beginning_of(plan: Plan) -> tuple[float, float] | None:
    """Where the plan begins, in degrees: its home, else its first place. None: wherever the vehicle is."""
    if plan.home is not None:
        return plan.home.latitude_deg, plan.home.longitude_deg
    point = next((point for item in plan.items if (point := item.point()) is not None), None)
    return None if point is None else (point.latitude_deg, point.longitude_deg)


def distance_to(beginning: tuple[float, float] | None, state: VehicleState) -> float | None:
    """Metres over ground from the vehicle; None if either is not known."""
    if beginning is None or state.latitude_deg is None or state.longitude_deg is None:
        return None
    return round(distance_m(state.latitude_deg, state.longitude_deg, *beginning), 1)
