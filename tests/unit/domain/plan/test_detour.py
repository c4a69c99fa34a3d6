"""An alternate is on board from the start, and a vehicle that is told nothing never goes there."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import HealthCheck, given, settings

from app.cli.run_view import assess
from app.domain.autopilot.declared import default_facts
from app.domain.delivery.comparison import compare
from app.domain.drop.record import Certainty, DropOutcome, DropPhase, DropRecord
from app.domain.events.run import RunItemEnded
from app.domain.flight.progress import MissionProgress
from app.domain.jobs.job import why_bad
from app.domain.mission import MavCmd, Mission, MissionItem
from app.domain.plan import Plan
from app.domain.plan.compiler import compile_plan
from app.domain.plan.parse import PlanInvalid
from app.domain.prediction import predict
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import Run, RunState
from tests.support.plan_pieces import at, gripper, multicopter, plan, rover, waypoint
from tests.support.plan_strategies import PLANS, sensible_plans
from tests.support.reasons import some

SLOW_DATA = settings(suppress_health_check=[HealthCheck.too_slow], deadline=None, max_examples=60)
LOCKER = at(100, 80, relative_altitude_m=30, id="locker", hold_s=20)
DELIVERY = multicopter(waypoint(id="door"), gripper(id="drop", alternate=LOCKER), waypoint(0, 50, id="gate"))


def compiled(of: Plan) -> Mission:
    return compile_plan(of, default_facts(of.vehicle_type))


def flown_seqs(items: Sequence[MissionItem]) -> list[int]:
    """What a vehicle flies that is told nothing, as PX4's navigator takes its jumps."""
    taken: dict[int, int] = {}
    seq, flown = 0, []
    while seq < len(items) and len(flown) < 3000:
        item = items[seq]
        if item.command is MavCmd.DO_JUMP and taken.get(seq, 0) < int(item.param2):
            taken[seq] = taken.get(seq, 0) + 1
            seq = int(item.param1)
            continue
        flown += [seq] if item.command is not MavCmd.DO_JUMP else []
        seq += 1
    return flown


@SLOW_DATA
@given(sensible_plans())
def test_the_mission_never_leads_into_a_detour_by_itself(plan: Plan) -> None:
    mission = compiled(plan)
    flown = set(flown_seqs(mission.items))
    assert all(flown.isdisjoint(detour) for detour in mission.detours)
    outside = {item.seq for item in mission.items if item.command is not MavCmd.DO_JUMP}
    assert outside - flown == {seq for detour in mission.detours for seq in detour}


@SLOW_DATA
@given(sensible_plans())
def test_without_its_alternates_a_plan_is_the_same_flight(plan: Plan) -> None:
    """But for the hold: it is longer by the time that it takes to leave for an alternate."""
    without = plan.model_copy(
        update={
            "items": tuple(
                [item.model_copy(update={"alternate": None} if item.type == "gripper" else {}) for item in plan.items]
            )
        }
    )
    mission, plain = compiled(plan), compiled(without)
    kept = [item for seq in flown_seqs(mission.items) for item in [mission.items[seq]]]
    meant = [plain.items[seq] for seq in flown_seqs(plain.items)]
    assert [(item.command, item.x, item.y, item.z) for item in kept] == [
        (item.command, item.x, item.y, item.z) for item in meant
    ]


@SLOW_DATA
@given(sensible_plans())
def test_from_the_end_of_a_detour_the_mission_goes_on(plan: Plan) -> None:
    mission = compiled(plan)
    for drop in mission.drops:
        if drop.alternate is not None:
            assert drop.resume_seq == drop.alternate.resume_seq < len(mission.items)
            assert max(drop.hold_seqs) < (drop.alternate_seq or 0) <= min(drop.alternate.hold_seqs)
            released = {MavCmd.DO_GRIPPER, MavCmd.DO_WINCH}
            assert not released & {
                mission.items[seq].command for seq in range(drop.alternate_seq or 0, drop.resume_seq)
            }


def test_the_jump_over_a_detour_is_never_used_up() -> None:
    """PX4 counts in 16 bits without a sign: -1 for always would become 0 on some boards."""
    jump = compiled(DELIVERY).items[2]
    assert (jump.command, jump.param1, jump.param2) == (MavCmd.DO_JUMP, 4.0, 65535.0)


def test_a_drop_with_an_alternate_holds_longer_by_the_time_to_leave_and_releases_nothing_in_it() -> None:
    mission = compiled(DELIVERY)
    (drop,) = mission.drops
    assert (mission.items[1].param1, drop.hold_s, drop.leave_s) == (35.0, 30.0, 5.0)
    assert (mission.items[3].param1, mission.items[3].param2) == (20.0, 1.0)


def test_a_rover_waits_at_its_alternate_in_a_delay() -> None:
    mission = compiled(rover(waypoint(), gripper(id="drop", alternate=LOCKER)))
    names = [item.command.name for item in mission.items]
    assert names == ["NAV_WAYPOINT", "NAV_DELAY", "DO_JUMP", "NAV_WAYPOINT", "NAV_DELAY", "NAV_WAYPOINT"]
    assert mission.detours == (range(3, 5),)


def test_a_plan_that_ends_with_its_drop_gets_an_item_to_jump_to() -> None:
    mission = compiled(plan("rover", waypoint(), gripper(id="drop", alternate=LOCKER)))
    assert mission.items[2].param1 == len(mission.items) - 1


def test_ids_of_alternates_are_unique_too() -> None:
    with pytest.raises(PlanInvalid) as caught:
        multicopter(waypoint(id="locker"), gripper(alternate=LOCKER))
    assert [(f.code, f.pointer) for f in caught.value.findings] == [("plan.duplicate_id", "/items/2/alternate/id")]


@SLOW_DATA
@given(PLANS)
def test_an_alternate_without_an_id_gets_one_of_its_own(plan: Plan) -> None:
    names = [item.id for item in plan.items] + [alternate.id for _, alternate in plan.alternates]
    assert all(names)
    assert len(set(names)) == len(names)


# progress -------------------------------------------------------------------------------------------------------


def test_what_the_mission_jumps_over_is_not_flown() -> None:
    progress = MissionProgress.of(compiled(DELIVERY)).now_current(1).also_flown("drop", through_seq=1).now_current(4)
    assert progress.flown == ("item-1", "door", "drop")
    assert progress.completed().flown == ("item-1", "door", "drop", "gate", "item-5")


def test_a_visit_to_the_alternate_is_flown() -> None:
    progress = MissionProgress.of(compiled(DELIVERY)).now_current(1).also_flown("drop", through_seq=1).now_current(3)
    assert progress.item_id == "locker"
    assert progress.now_current(4).flown == ("item-1", "door", "drop", "locker")


def test_an_alternate_that_was_only_seen_as_reached_is_flown() -> None:
    progress = MissionProgress.of(compiled(DELIVERY)).now_current(1).reached(3)
    assert progress.flown == ("item-1", "door", "locker")


# prediction, comparison, assessment -- ------------------------------------------------------------------------------


def test_the_timeline_names_an_alternate_and_leaves_it_out() -> None:
    timeline = predict(DELIVERY, default_facts(DELIVERY.vehicle_type))
    assert timeline.order == ("item-1", "door", "drop", "gate", "item-5")
    (alternate,) = timeline.alternates
    assert (alternate.item_id, alternate.drop_id, alternate.seqs) == ("locker", "drop", (3,))
    assert 79.0 < alternate.distance_m < 81.0
    assert timeline.longest_duration_s is not None
    assert timeline.longest_duration_s > timeline.duration_s + 30.0, "the whole hold was waited in vain"


def run_over_the_alternate() -> Run:
    drops = (
        DropRecord(
            plan_item_id="drop", supervised=True, phase=DropPhase.DONE, outcome=DropOutcome.KEPT, reason=some("no")
        ),
        DropRecord(
            plan_item_id="locker",
            supervised=True,
            alternate_to="drop",
            phase=DropPhase.DONE,
            outcome=DropOutcome.RELEASED,
            certainty=Certainty.ACKNOWLEDGED,
            attempts=1,
        ),
    )
    return Run(
        id="r",
        plan_id="p",
        plan_hash="h",
        vehicle_id="v",
        state=RunState.COMPLETED,
        drops=drops,
        created_at=0,
        updated_at=0,
    )


def test_what_was_flown_from_an_alternate_is_not_compared() -> None:
    timeline = predict(DELIVERY, default_facts(DELIVERY.vehicle_type))
    flown = [
        RunItemEnded(item_id=name, began_s=0.0, ended_s=10.0)
        for name in ("item-1", "door", "drop", "locker", "gate", "item-5")
    ]
    items = {item.item_id: item for item in compare(run_over_the_alternate(), timeline, flown).items}
    assert items["locker"].reason == Reason.of(ReasonCode.ALTERNATE_OF, item_id="drop")
    assert (items["gate"].flown_s, items["gate"].reason) == (None, Reason.of(ReasonCode.FLOWN_FROM, item_id="locker"))
    assert items["item-5"].flown_s == 10.0


def test_a_parcel_that_was_released_at_the_alternate_is_delivered() -> None:
    run = run_over_the_alternate()
    assert assess(run, least=Certainty.ACKNOWLEDGED).achieved
    assert why_bad(run) is None
    failed = run.model_copy(update={"drops": (run.drops[0],)})
    assert not assess(failed, least=Certainty.ACKNOWLEDGED).achieved
