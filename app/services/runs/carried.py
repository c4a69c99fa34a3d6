"""Which mission of a run a vehicle carries that was found again: the newest, or a change that was on its way to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from app.domain.compiler import compile_plan
from app.domain.continuation import rest_of
from app.domain.drop import DropPhase
from app.domain.events.run import RunChanged, RunMissionChanged
from app.domain.flight.leg import changed_to
from app.domain.mission import Mission, MissionItem
from app.domain.plan import Plan
from app.domain.prediction import CALM, Timeline, predict
from app.domain.reason import ReasonCode, because
from app.domain.run import PlanChange, Run
from app.domain.vehicle import VehicleFacts
from app.services.runs.closing import closed
from app.services.runs.recorder import RunRecorder
from app.services.runs.settings import RECORDED_VISITS

WHILE_AWAY = because(ReasonCode.PLAN_CHANGED_WHILE_AWAY)


@dataclass(frozen=True, slots=True)
class Carried:
    """`run` is as it is with this mission on board; `arrived` and `timeline` if that is news."""

    run: Run
    plan: Plan
    mission: Mission
    arrived: PlanChange | None = None
    timeline: Timeline | None = None

    def tell(self, recorder: RunRecorder) -> None:
        """Record what a restart has shown of a change."""
        if self.arrived is not None and self.timeline is not None:
            recorder.note(RunMissionChanged(change=self.arrived, timeline=self.timeline))
            recorder.note(RunChanged(self.run))
        else:
            recorder.change(changing=None)


def carried_as_told(
    run: Run, plan: Plan, facts: VehicleFacts, on_board: Sequence[MissionItem], mission_id: int | None
) -> Carried | None:
    """The run's own mission, if the vehicle carries it."""
    mission = compiled(plan, run.change, facts)
    named = run.mission_id is not None and mission_id == run.mission_id
    held = _held(mission, on_board, named=named)
    return None if held is None else Carried(run, plan, held)


def carried_change(
    run: Run,
    change: PlanChange,
    plan: Plan,
    facts: VehicleFacts,
    on_board: Sequence[MissionItem],
    mission_id: int | None,
) -> Carried | None:
    """The mission of a change that nobody saw arrive, if the vehicle carries it."""
    mission = compiled(plan, change, facts)
    held = _held(mission, on_board, named=mission_id == change.mission_id)
    if held is None:
        return None
    ahead = {drop.plan_item_id for drop in mission.drops}
    drops = tuple(
        closed(drop, WHILE_AWAY, took_off=True)
        if drop.phase is not DropPhase.DONE and drop.plan_item_id not in ahead
        else drop
        for drop in run.drops
    )
    run = run.model_copy(update={"drops": drops})
    run = run.model_copy(update=changed_to(run, change, mission))
    rest = rest_of(plan, change.continue_at, change.left_out)
    timeline = predict(rest.plan, replace(facts, in_flight=change.began), run.wind or CALM).first(RECORDED_VISITS)
    return Carried(run, plan, held, change, timeline)


def compiled(plan: Plan, change: PlanChange | None, facts: VehicleFacts) -> Mission:
    """The mission as it was uploaded: whole, or what was left of the plan when it was changed in flight."""
    if change is None:
        return compile_plan(plan, facts)
    rest = rest_of(plan, change.continue_at, change.left_out)
    return compile_plan(rest.plan, replace(facts, in_flight=change.began))


def _held(mission: Mission, on_board: Sequence[MissionItem], *, named: bool) -> Mission | None:
    """The mission as the vehicle has it, by its id or item by item; None if it carries another."""
    if [item.command for item in on_board] != [item.command for item in mission.items]:
        return None
    if named:
        return replace(mission, items=tuple(on_board))  # as uploaded, though a parameter or home changed since
    same = all(a.same_as(b) for a, b in zip(mission.items, on_board, strict=True))
    return mission if same else None
