"""After a restart of the service: which mission of a run the vehicle carries, and how a run ends that is not found."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from app.domain.drop.record import Certainty, DropOutcome, DropPhase, DropRecord
from app.domain.drop.supervised_inputs import GRIPPER_OPEN_US
from app.domain.events.run import RunMissionChanged
from app.domain.flight.flight import Flight
from app.domain.flight.inputs import Observation, Observed, Recovered
from app.domain.flight.phase import is_landing_unsure, stands_disarmed
from app.domain.flight.segment import fields_after_change
from app.domain.flight.step import UNFINISHED_DROPS_S, step
from app.domain.flight.supervised_release import withdrawn
from app.domain.mission import CompiledDrop, MavCmd, Mission, MissionItem, mission_hash
from app.domain.plan import Plan
from app.domain.plan.compiler import compile_plan
from app.domain.prediction import CALM, predict
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.remaining_mission import rest_of
from app.domain.run.run import NOT_STARTED, PlanChange, Run, RunState
from app.domain.vehicle.state import LandedState, MissionState, VehicleProfile, VehicleState

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
    unobserved. A drop whose gripper others used is unknown, and one whose output was observed at release is never kept.
    """
    if drop.phase is DropPhase.DONE:
        return drop
    outcome, certainty = DropOutcome.UNKNOWN, Certainty.NONE
    if drop.gripper_used_by is not None:
        reason = drop.gripper_used_by.doubt(reason)
    elif drop.output_us == GRIPPER_OPEN_US:
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


# A run whose vehicle is there, while the mission on board cannot be read.


def unread(run: Run, code: str, detail: str) -> Run:
    """The run with the error that kept its mission from being read as its reason. The reason of before is kept behind
    it, and `updated_at` as it is: from then on a hold that was seen is counted.
    """
    cause = Reason.of_error(code, detail).model_copy(update={"cause": run.reason})
    return run.model_copy(update={"reason": Reason.of(ReasonCode.MISSION_UNREAD, cause)})


def as_before_unread(run: Run) -> Run:
    """The run with the reason that it had before `unread`; any other run as it is."""
    cause = _unread_cause(run)
    return run if cause is None else run.model_copy(update={"reason": cause.cause})


def why_unread(run: Run) -> str | None:
    """What kept its mission from being read; None if it was not tried, or can be read."""
    cause = _unread_cause(run)
    return None if cause is None else str(cause.params["detail"])


def _unread_cause(run: Run) -> Reason | None:
    return run.reason.cause if run.reason is not None and run.reason.code is ReasonCode.MISSION_UNREAD else None


def ended_unread(flight: Flight, observed: Observation) -> Run | None:
    """The run of a vehicle that has landed and disarmed, while its mission could not be read; None if that is not sure.

    `flight` is one of the mission as it was compiled. It is judged as any other that nobody saw, by where the vehicle
    stands. What it reports of its mission does not count: it may be another one.
    """
    if not stands_disarmed(observed.state) or is_landing_unsure(observed.state):
        return None
    state = replace(observed.state, mission_seq=None, mission_id=None, mission_state=MissionState.UNKNOWN)
    observed = replace(observed, state=state)
    flight, _ = step(flight, Recovered(observed, in_flight=True, flown=flight.run.flown_item_ids))
    for later_s in (0.0, UNFINISHED_DROPS_S, 2.0 * UNFINISHED_DROPS_S):  # for its last reports nobody waits
        flight, _ = step(flight, Observed(replace(observed, now_s=observed.now_s + later_s)))
    return flight.run if flight.run.is_over else None


# Which mission of a run a vehicle carries that was found again: the newest, or a change that was on its way to it.


@dataclass(frozen=True, slots=True)
class OnboardMission:
    """`run` is as it is with this mission on board; `arrived` if that is news."""

    run: Run
    plan: Plan
    mission: Mission
    arrived: RunMissionChanged | None = None


@dataclass(frozen=True, slots=True)
class CarriedItems:
    """What a vehicle tells of the mission that it carries.

    `mission_id` is MISSION_CURRENT's, None if it names none. `items` None: they were not read. `id_of` is the id by
    which the vehicle names a mission.
    """

    mission_id: int | None
    items: Sequence[MissionItem] | None
    id_of: Callable[[Mission], int]

    def held(self, mission: Mission, mission_id: int | None, digest: str | None) -> Mission | None:
        """The mission as the vehicle has it, by its id or item by item; None if it carries another, or none is known.

        Compiled anew it may be another than what was uploaded, because a parameter or home changed since. Without the
        items it is known only if it is the same: `mission_id` and `digest` (mission_hash) are of the upload.
        """
        named = mission_id is not None and self.mission_id == mission_id
        if self.items is None:
            same = named and mission_hash(mission) == digest and self.id_of(mission) == mission_id
            return mission if same else None
        if [item.command for item in self.items] != [item.command for item in mission.items]:
            return None
        if named:
            return replace(mission, items=tuple(self.items))  # as uploaded
        same = all(a.same_as(b) for a, b in zip(mission.items, self.items, strict=True))
        return mission if same else None


def carried_mission(
    run: Run, plan: Plan, changed: Plan | None, facts: VehicleProfile, carried: CarriedItems
) -> OnboardMission | None:
    """The run's mission, or that of the change that nobody saw arrive, if the vehicle carries it; None if another.

    `changed` is the plan of the change under way, None if none is.
    """
    if changed is not None and run.changing is not None:
        found = _changed_mission(run, run.changing, changed, facts, carried)
        if found is not None:
            return found
    mission = carried.held(compile_uploaded(run, plan, facts), run.mission_id, run.mission_hash)
    return None if mission is None else OnboardMission(run, plan, mission)


def _changed_mission(
    run: Run, change: PlanChange, plan: Plan, facts: VehicleProfile, carried: CarriedItems
) -> OnboardMission | None:
    mission = compile_part(plan, change, facts)
    held = carried.held(mission, change.mission_id, change.mission_hash)
    if held is None:
        return None
    ahead = {drop.plan_item_id for drop in mission.drops}
    drops = tuple(drop if drop.plan_item_id in ahead else closed(drop, WHILE_AWAY, took_off=True) for drop in run.drops)
    run = run.model_copy(update={"drops": drops})
    run = run.model_copy(update=fields_after_change(run, change, mission))
    rest = rest_of(plan, change.continue_at, change.omitted)
    timeline = predict(rest.plan, replace(facts, in_flight=change.began), run.wind or CALM).first(RECORDED_VISITS)
    return OnboardMission(run, plan, held, RunMissionChanged(change=change, timeline=timeline))


def compile_uploaded(run: Run, plan: Plan, facts: VehicleProfile) -> Mission:
    """The run's mission as it was uploaded, as far as is known: home has moved since, by its takeoff at the least."""
    if run.change is None and run.compiled_home is not None:
        facts = replace(facts, home=run.compiled_home)
    return compile_part(plan, run.change, facts)


def compile_part(plan: Plan, change: PlanChange | None, facts: VehicleProfile) -> Mission:
    """The mission as it was uploaded: whole, or what was left of the plan when it was changed in flight."""
    if change is None:
        return compile_plan(plan, facts)
    rest = rest_of(plan, change.continue_at, change.omitted)
    return compile_plan(rest.plan, replace(facts, in_flight=change.began))
