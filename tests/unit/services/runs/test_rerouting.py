"""Stops that are put into a run's plan while somebody else changes it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from app.domain.errors import ChangeUnderWayError
from app.domain.plan import Plan, parse_plan
from app.services.plans import Plans
from app.services.runs import Runs
from app.services.runs.rerouting import Rerouting
from tests.support.plan_pieces import plan_json, takeoff, waypoint

PLAN = parse_plan(plan_json("multicopter", takeoff(), waypoint(id="clinic"), waypoint(id="school")))


class Changing:
    """A run that gets another plan, or comes to another item, while its plan with the new stops is checked."""

    def __init__(self, **meanwhile: str) -> None:
        self.run = SimpleNamespace(plan_id="plan-1", item_id="clinic")
        self.sent: list[str | None] = []
        self._meanwhile = meanwhile

    async def get(self, _: str) -> SimpleNamespace:
        return self.run

    async def plan(self, _: str) -> Plan:
        return PLAN

    async def checked(self, plan: Plan, _: str) -> Plan:
        self.run = SimpleNamespace(**{**vars(self.run), **self._meanwhile})
        return plan

    async def change_mission(self, run_id: str, plan: Plan, continue_at: str | None, *_: Any, **__: Any) -> str:
        self.sent.append(continue_at)
        return run_id


async def insert(at: Changing) -> None:
    rerouting = Rerouting(cast(Runs, at), cast(Plans, at))
    await rerouting.insert("run-1", [waypoint(id="new")], at="clinic", after=False, actor="test")


async def test_stops_are_not_put_into_a_plan_that_the_run_does_not_fly_any_more() -> None:
    at = Changing(plan_id="plan-2")
    with pytest.raises(ChangeUnderWayError):
        await insert(at)
    assert at.sent == [], "the stops that the other change brought would be lost"


@pytest.mark.parametrize(("current", "continue_at"), [("clinic", "new"), ("school", None)])
async def test_whether_the_new_stops_come_next_is_told_by_where_the_vehicle_is_when_they_are_sent(
    current: str, continue_at: str | None
) -> None:
    at = Changing(item_id=current)
    await insert(at)
    assert at.sent == [continue_at]
