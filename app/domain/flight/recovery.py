"""After a restart of the service: which mission of a run the vehicle carries, and how a run ends that is not found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from app.domain.drop.record import Certainty, DropOutcome, DropPhase, DropRecord
from app.domain.drop.supervised_inputs import GRIPPER_OPEN_US
from app.domain.events.run import RunMissionChanged
from app.domain.flight.segment import fields_after_change
from app.domain.flight.supervised_release import withdrawn
from app.domain.mission import CompiledDrop, MavCmd, Mission, MissionItem
from app.domain.plan import Plan
from app.domain.plan.compiler import compile_plan
from app.domain.prediction import CALM, predict
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.remaining_mission import rest_of
from app.domain.run.run import NOT_STARTED, PlanChange, Run, RunState
from app.domain.vehicle.state import LandedState, VehicleProfile, VehicleState

RECORDED_VISITS = 500
"""Of a prediction: nested jumps can make more, and every one of them is stored."""
WHILE_AWAY = Reason.of(ReasonCode.PLAN_CHANGED_WHILE_AWAY)


def ended_unseen(run: Run, state: RunState, reason: Reason, now: float) -> Run:
    """The run at its end, unobserved: each drop gets the outcome that its record allows. `now` in Unix seconds."""
    took_off = run.state not in NOT_STARTED
    drops = tuple(closed(drop, reason, took_off=took_off, is_told=not run.is_new_here) for drop in run.drops)
    run = run.model_copy(update={"drops": drops, "item_id": None})
    return run.moved_to(state, now=now, reason=reason)


def closed(drop: DropRecord, reason: Reason, *, took_off: bool, is_told: bool = True) -> DropRecord:
    """Return a drop as it is at the end of its run; a drop that has ended is not changed.

    A supervised drop that was never commanded is kept, if every command is told; an embedded one may have happened
    unobserved. A drop whose output was observed at release is never kept.
    """
    if drop.phase is DropPhase.DONE:
        return drop
    outcome, certainty = DropOutcome.UNKNOWN, Certainty.NONE
    if drop.output_us == GRIPPER_OPEN_US:
        if drop.commanded_at is not None:
            outcome, certainty = DropOutcome.RELEASED, Certainty.INFERRED
            reason = Reason.of(ReasonCode.DROP_ACK_MISSING_RELEASED_THEN, reason)
    elif is_told and (not took_off or (drop.supervised and drop.attempts == 0)):
        outcome, certainty = DropOutcome.KEPT, Certainty.INFERRED
    changes: dict[str, object] = {"phase": DropPhase.DONE, "outcome": outcome, "certainty": certainty, "reason": reason}
    if drop.consent is not None and drop.attempts == 0:
        changes["consent"] = withdrawn(drop.consent, reason)
    return drop.model_copy(update=changes)


def taken_over(run: Run, mission: Mission, state: VehicleState) -> Run:
    """The run of another gateway, once its vehicle is found.

    A supervised drop that the vehicle may have come to may have been released untold: none is commanded there again.
    """
    if run.taken_over is None or run.taken_over.is_found:
        return run
    compiled = [one for drop in mission.drops for one in (drop, drop.alternate) if one is not None and one.supervised]
    returns = any(item.command is MavCmd.DO_JUMP for item in mission.items)
    doubtful = {one.plan_item_id for one in compiled if returns or _may_have_come_to(one, state)}
    drops = tuple(
        drop.model_copy(update={"attempts": 1}) if drop.plan_item_id in doubtful and _is_untouched(drop) else drop
        for drop in run.drops
    )
    found = run.taken_over.model_copy(update={"is_found": True})
    return run.model_copy(update={"drops": drops, "taken_over": found})


def _is_untouched(drop: DropRecord) -> bool:
    return drop.attempts == 0 and drop.phase is not DropPhase.DONE


def _may_have_come_to(drop: CompiledDrop, state: VehicleState) -> bool:
    """Unless it flies, and to an item before the drop: from the drop it may have been led away, or have landed."""
    if state.mission_seq is None or state.armed is not True or state.landed is LandedState.ON_GROUND:
        return True
    return state.mission_seq >= min(drop.hold_seqs)


# Which mission of a run a vehicle carries that was found again: the newest, or a change that was on its way to it.


@dataclass(frozen=True, slots=True)
class OnboardMission:
    """`run` is as it is with this mission on board; `arrived` if that is news."""

    run: Run
    plan: Plan
    mission: Mission
    arrived: RunMissionChanged | None = None


def recorded_mission(
    run: Run, plan: Plan, facts: VehicleProfile, on_board: Sequence[MissionItem], mission_id: int | None
) -> OnboardMission | None:
    """The run's own mission, if the vehicle carries it."""
    mission = compile_part(plan, run.change, facts)
    named = run.mission_id is not None and mission_id == run.mission_id
    held = _held(mission, on_board, named=named)
    return None if held is None else OnboardMission(run, plan, held)


def changed_mission(
    run: Run,
    change: PlanChange,
    plan: Plan,
    facts: VehicleProfile,
    on_board: Sequence[MissionItem],
    mission_id: int | None,
) -> OnboardMission | None:
    """The mission of a change that nobody saw arrive, if the vehicle carries it."""
    mission = compile_part(plan, change, facts)
    held = _held(mission, on_board, named=mission_id == change.mission_id)
    if held is None:
        return None
    ahead = {drop.plan_item_id for drop in mission.drops}
    drops = tuple(drop if drop.plan_item_id in ahead else closed(drop, WHILE_AWAY, took_off=True) for drop in run.drops)
    run = run.model_copy(update={"drops": drops})
    run = run.model_copy(update=fields_after_change(run, change, mission))
    rest = rest_of(plan, change.continue_at, change.omitted)
    timeline = predict(rest.plan, replace(facts, in_flight=change.began), run.wind or CALM).first(RECORDED_VISITS)
    return OnboardMission(run, plan, held, RunMissionChanged(change=change, timeline=timeline))


def compile_part(plan: Plan, change: PlanChange | None, facts: VehicleProfile) -> Mission:
    """The mission as it was uploaded: whole, or what was left of the plan when it was changed in flight."""
    if change is None:
        return compile_plan(plan, facts)
    rest = rest_of(plan, change.continue_at, change.omitted)
    return compile_plan(rest.plan, replace(facts, in_flight=change.began))


def _held(mission: Mission, on_board: Sequence[MissionItem], *, named: bool) -> Mission | None:
    """The mission as the vehicle has it, by its id or item by item; None if it carries another."""
    if [item.command for item in on_board] != [item.command for item in mission.items]:
        return None
    if named:
        return replace(mission, items=tuple(on_board))  # as uploaded, though a parameter or home changed since
    same = all(a.same_as(b) for a, b in zip(mission.items, on_board, strict=True))
    return mission if same else None
