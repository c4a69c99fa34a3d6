"""The list of runs: filtered, page by page, and as a table that no spreadsheet runs."""

from __future__ import annotations

from typing import Any

from app.domain.run.run import Run, RunState
from tests.support.deliveries import a_plan
from tests.support.service_in_process import Service

STATES = (RunState.COMPLETED, RunState.FLYING, RunState.FAILED, RunState.AT_DROP, RunState.COMPLETED)


def a_run(number: int, plan_id: str = "p", **changes: Any) -> Run:
    """Run number N of vehicle v1 or v2, made at 1000 + N s."""
    return Run(
        id=f"run-{number}",
        plan_id=plan_id,
        plan_hash="ab",
        vehicle_id=f"v{number % 2 + 1}",
        state=STATES[number % len(STATES)],
        created_at=1000.0 + number,
        updated_at=1.0,
    ).model_copy(update=changes)


async def fill(service: Service, plan: dict[str, Any], count: int = 5) -> list[str]:
    """Runs of two plans, and the plans' ids."""
    plans = [await a_plan(service, plan), await a_plan(service, {**plan, "name": "another"})]
    await service.storage.events.append([], [a_run(number, plans[number % 2]) for number in range(count)])
    return plans
