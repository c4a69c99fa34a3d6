"""A plan that the vehicle would not fly, as it is now, is refused: before the upload, and again at each start."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import replace
from typing import Protocol

from app.domain.compiler import compile_plan
from app.domain.errors import PlanRejectedError
from app.domain.mission import Mission
from app.domain.plan import Plan
from app.domain.prediction import Timeline, Wind
from app.domain.rules import Finding, Severity, check_plan, checked
from app.domain.vehicle import GlobalPosition, VehicleFacts
from app.services.runs.settings import RECORDED_VISITS


class FactsRead(Protocol):
    """See Fleet.facts."""

    def __call__(self, *, fresh: bool = False) -> Awaitable[VehicleFacts]:
        """Raises LinkError."""


async def refuse_unfit_plan(plan: Plan, facts: VehicleFacts, wind: Wind) -> None:
    """Raises PlanRejectedError with all findings; slow plans are checked in a thread."""
    _refuse_errors(await asyncio.to_thread(check_plan, plan, facts, wind))


async def refuse_changed_vehicle(
    plan: Plan,
    home: GlobalPosition | None,
    now: VehicleFacts,
    wind: Wind,
    id_of: Callable[[Mission], int],
    on_board: int,
) -> None:
    """Before arming, with parameters read just now. `on_board` is the id of the mission that the vehicle holds, and
    `home` the one that it was compiled with: it stays where it is when home moves.

    Raises PlanRejectedError, with `parameters_age_s` too.
    """
    try:
        await refuse_unfit_plan(plan, now, wind)
        if id_of(compile_plan(plan, replace(now, home=home))) != on_board:
            raise PlanRejectedError(
                "the vehicle's parameters changed since the upload: its mission would be another now",
                hint="abort the run, and order it again",
                findings=[],
            )
    except PlanRejectedError as error:
        found = {**error.extra, "parameters_age_s": now.parameters_age_s}
        raise PlanRejectedError(error.detail, hint=error.hint, **found) from error


async def compiled_and_predicted(plan: Plan, facts: VehicleFacts, wind: Wind) -> tuple[Mission, Timeline]:
    """The mission, and what the vehicle is predicted to do with it, by its own parameters.

    Raises PlanRejectedError.
    """
    found = await asyncio.to_thread(checked, plan, facts, wind)
    _refuse_errors(found.findings)
    return compile_plan(plan, facts), found.timeline.first(RECORDED_VISITS)


def _refuse_errors(findings: Sequence[Finding]) -> None:
    errors = [finding for finding in findings if finding.severity is Severity.ERROR]
    if errors:
        raise PlanRejectedError(
            f"the plan cannot be flown by this vehicle: {errors[0].message}",
            hint="mend what the findings name, and post it as a new plan",
            findings=[finding.model_dump(mode="json") for finding in findings],
        )
