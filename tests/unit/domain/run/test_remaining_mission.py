"""What is left of a run that is over: begun with a takeoff, without the drops that are over."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.domain.drop.record import DropOutcome, DropPhase, DropRecord
from app.domain.errors import (
    ChangeUnderWayError,
    NoRemainingItemsError,
    PlanRejectedError,
    RunContinuedError,
    RunNotOverError,
)
from app.domain.items import ChangeSpeed, Takeoff
from app.domain.plan import Plan, parse_plan
from app.domain.plan.drops import drops_of
from app.domain.plan.walk import reference_home, speeds_along, walk
from app.domain.rules import check_plan, default_facts
from app.domain.run.remaining_mission import drops_over, refuse_continued, tail_of
from app.domain.run.run import PlanChange, Run, RunState
from app.domain.validation.finding import Severity
from app.domain.vehicle.state import InFlight
from tests.support.paths import PLANS
from tests.support.plan_strategies import sensible_plans

MANY = settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
OTHER_WAY = ("geofence.", "limits.", "energy.", "distance.")
"""What a rule may find on the way from the takeoff to where it goes on, which the plan never flew."""


def plan_of(name: str = "clinic-run.json", **changes: Any) -> Plan:
    return parse_plan({**json.loads((PLANS / name).read_text()), **changes})


def run_of(plan: Plan, flown: tuple[str, ...] = (), **fields: Any) -> Run:
    fields = {"state": RunState.ABORTED, "flown_item_ids": flown, **fields}
    return Run(id="run-1", plan_id="p", plan_hash="h", vehicle_id="v1", created_at=0, updated_at=0, **fields)


def drop(item_id: str, outcome: DropOutcome, alternate_to: str | None = None) -> DropRecord:
    return DropRecord(
        plan_item_id=item_id, supervised=True, outcome=outcome, phase=DropPhase.DONE, alternate_to=alternate_to
    )


def ids(plan: Plan) -> list[str]:
    return [item.id for item in plan.items]


def test_it_takes_off_and_goes_on_behind_the_last_item_done() -> None:
    plan = plan_of()
    run = run_of(plan, ("takeoff", "corner"), drops=(drop("drop", DropOutcome.KEPT),))
    assert ids(tail_of(run, plan)) == ["takeoff", "clinic", "drop", "home"]


def test_a_run_that_never_took_off_is_flown_whole() -> None:
    assert tail_of(run_of(plan_of()), plan_of()).items == plan_of().items


@pytest.mark.parametrize("outcome", [DropOutcome.RELEASED, DropOutcome.UNKNOWN, DropOutcome.PENDING])
def test_the_place_of_a_drop_that_is_over_is_left_out_where_it_would_come_first(outcome: DropOutcome) -> None:
    plan = plan_of()
    run = run_of(plan, ("takeoff", "corner"), drops=(drop("drop", outcome),))
    assert ids(tail_of(run, plan)) == ["takeoff", "home"]
    assert ids(tail_of(run, plan, "corner")) == ["takeoff", "corner", "clinic", "home"]
    with pytest.raises(PlanRejectedError):
        tail_of(run, plan, "drop")


def test_a_drop_that_was_kept_is_tried_again_at_its_place_and_one_made_at_its_alternate_is_not() -> None:
    plan = plan_of()
    kept = run_of(plan, ("takeoff", "corner", "clinic"), drops=(drop("drop", DropOutcome.KEPT),))
    assert ids(tail_of(kept, plan)) == ["takeoff", "clinic", "drop", "home"]
    ended_there = kept.model_copy(update={"flown_item_ids": ("takeoff", "corner", "clinic", "drop")})
    assert ids(tail_of(ended_there, plan)) == ["takeoff", "clinic", "drop", "home"]
    made = (*kept.drops, drop("drop-alternate", DropOutcome.RELEASED, "drop"))
    assert drops_over(kept.model_copy(update={"drops": made})) == {"drop", "drop-alternate"}
    assert ids(tail_of(kept.model_copy(update={"drops": made}), plan)) == ["takeoff", "home"]


def test_after_a_change_it_goes_on_in_what_was_left_then() -> None:
    plan = plan_of()
    change = PlanChange(
        plan_id="p",
        plan_hash="h",
        mission_hash="m",
        mission_id=1,
        continue_at="clinic",
        omitted=(),
        began=InFlight(latitude_deg=47.0, longitude_deg=8.0, relative_altitude_m=15.0),
        actor="ann",
        at=0.0,
    )
    skipped = run_of(plan, ("takeoff",), change=change, flown_before_change=1)
    assert ids(tail_of(skipped, plan)) == ["takeoff", "clinic", "drop", "home"]
    back = run_of(plan, ("takeoff", "corner", "clinic", "drop"), change=change, flown_before_change=4)
    assert ids(tail_of(back, plan)) == ["takeoff", "clinic", "drop", "home"]


@pytest.mark.parametrize("flown", [("slow", "takeoff", "corner"), ("takeoff", "slow", "corner")], ids="-".join)
def test_the_speed_in_force_is_asked_for_again(flown: tuple[str, ...]) -> None:
    document = json.loads((PLANS / "clinic-run.json").read_text())
    document["items"].insert(flown.index("slow"), {"id": "slow", "type": "change_speed", "speed_m_s": 3.5})
    plan = parse_plan(document)
    tail = tail_of(run_of(plan, flown), plan)
    assert [item.type for item in tail.items][:3] == ["takeoff", "change_speed", "waypoint"]
    assert isinstance(tail.items[1], ChangeSpeed)
    assert tail.items[1].speed_m_s == 3.5


def test_a_vtol_turns_where_the_plan_turned() -> None:
    plan = plan_of("vtol-hover-drop.json")
    steps = {item.type: index for index, item in enumerate(plan.items)}
    turn = next(index for index, item in enumerate(plan.items) if item.type == "transition")
    before = next(item for item in reversed(plan.items[:turn]) if item.type == "waypoint")
    flown = tuple(item.id for item in plan.items[: turn + 1])
    tail = tail_of(run_of(plan, flown), plan)
    assert ids(tail)[:3] == [plan.items[steps["takeoff"]].id, before.id, plan.items[turn].id]
    assert ids(tail_of(run_of(plan, flown[:-1]), plan)) == ids(tail)


def test_what_cannot_be_continued_says_why() -> None:
    plan = plan_of()
    with pytest.raises(RunNotOverError):
        refuse_continued(run_of(plan, state=RunState.FLYING), is_ending=False)
    with pytest.raises(RunNotOverError):
        refuse_continued(run_of(plan), is_ending=True)
    with pytest.raises(RunContinuedError):
        refuse_continued(run_of(plan, continued_by="run-2"), is_ending=False)
    with pytest.raises(NoRemainingItemsError):
        refuse_continued(run_of(plan, state=RunState.COMPLETED), is_ending=False)
    with pytest.raises(NoRemainingItemsError):
        tail_of(run_of(plan, tuple(ids(plan))), plan)
    with pytest.raises(PlanRejectedError):
        tail_of(run_of(plan), plan, "nowhere")
    refuse_continued(run_of(plan), is_ending=False)


def test_while_it_is_not_known_which_mission_was_flown_nothing_is_continued() -> None:
    plan = plan_of()
    began = InFlight(latitude_deg=47.0, longitude_deg=8.0, relative_altitude_m=15.0)
    change = PlanChange(
        plan_id="q", plan_hash="h", mission_hash="m", mission_id=1, continue_at="home", omitted=(), began=began,
        actor="ann", at=0.0,
    )  # fmt: skip
    with pytest.raises(ChangeUnderWayError):
        refuse_continued(run_of(plan, changing=change), is_ending=False)


def test_no_tail_has_a_drop_that_is_over_and_each_takes_off_at_the_speeds_in_force_and_passes_the_rules() -> None:
    passed = 0

    @MANY
    @given(sensible_plans(), st.data())
    def law(plan: Plan, data: st.DataObject) -> None:
        nonlocal passed
        facts = default_facts(plan.vehicle_type)
        if errors(plan):
            return
        uses = drops_of(walk(plan, reference_home(plan, None)))
        drops = [use.item.id for use in uses if use.releases]
        over = data.draw(st.sets(st.sampled_from(drops))) if drops else set()
        flown = tuple(ids(plan)[: data.draw(st.integers(0, len(plan.items) - 1))])
        records = tuple(drop(i, DropOutcome.UNKNOWN if i in over else DropOutcome.KEPT) for i in drops)
        run = run_of(plan, flown, drops=records)
        try:
            tail = tail_of(run, plan)
        except (NoRemainingItemsError, PlanRejectedError):
            return
        assert not set(ids(tail)) & over
        taken_off = any(isinstance(item, Takeoff) for item in plan.items)
        assert [isinstance(item, Takeoff) for item in tail.items] == [taken_off] + [False] * (len(tail.items) - 1)
        assert set(ids(plan)[len(flown) :]) - over - set(ids(tail)) <= left_out_first(plan, over, flown)
        found = [code for code in errors(tail) if not code.startswith(OTHER_WAY)]
        assert not found, (found, ids(plan), ids(tail))
        passed += 1
        home = reference_home(plan, facts)
        was = dict(zip(ids(plan), speeds_along(plan, facts, walk(plan, home)), strict=True))
        now = dict(zip(ids(tail), speeds_along(tail, facts, walk(tail, home)), strict=True))
        assert [now[i] for i in ids(plan)[len(flown) :] if i in now] == [
            was[i] for i in ids(plan)[len(flown) :] if i in now
        ]

    law()
    assert passed > 10, "too few runs went on to show anything"


def errors(plan: Plan) -> list[str]:
    found = check_plan(plan, default_facts(plan.vehicle_type))
    return [finding.code for finding in found if finding.severity is Severity.ERROR]


def left_out_first(plan: Plan, over: set[str], flown: tuple[str, ...]) -> set[str]:
    """Places done with and turns that the takeoff makes itself, before the first item that is left."""
    return {item.id for item in plan.items[len(flown) :] if item.type in ("waypoint", "loiter", "transition")}
