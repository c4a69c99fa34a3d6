"""With RTL_TYPE 1 to 4 PX4 returns along the mission to its landing, and reports that landing as reached."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.autopilot.declared import default_facts
from app.domain.drop.record import DropOutcome
from app.domain.flight.flight import DEFAULT_MAX_OFFSET_M, LOST_AFTER_S, Flight
from app.domain.flight.inputs import FactReceived
from app.domain.flight.segment import drop_records, segment_of
from app.domain.plan import parse_plan
from app.domain.plan.compiler import compile_plan
from app.domain.run.run import RunAction, RunState
from app.domain.vehicle.facts import ItemReached
from app.domain.vehicle.state import FlightMode, LandedState, MissionState
from tests.support.flown_flights import BEGAN_S, a_run
from tests.support.paths import PLANS
from tests.support.told_flight import Told

PLAN = parse_plan((PLANS / "vtol-hover-drop.json").read_text(encoding="utf-8"))
MISSION = compile_plan(PLAN, default_facts(PLAN.vehicle_type))
LANDING_SEQ = MISSION.items[-1].seq
OUT_SEQ = 1


def on_its_way_out() -> Told:
    run = a_run().model_copy(update={"drops": drop_records(MISSION)})
    segment = segment_of(run, PLAN, MISSION, DEFAULT_MAX_OFFSET_M, {})
    told = Told(flight=Flight.of(run, segment, BEGAN_S, LOST_AFTER_S, DEFAULT_MAX_OFFSET_M))
    told.see(1.0, mission_seq=0)
    told.see(1.0, mission_seq=OUT_SEQ)
    assert MISSION.ends_with_landing
    assert told.flight.progress.current == OUT_SEQ
    return told


def return_along(told: Told) -> None:
    told.see(2.0, mode=FlightMode.RETURN)
    told.see(2.0, mission_seq=LANDING_SEQ)
    told.feed(FactReceived(told.observed, ItemReached(LANDING_SEQ, FlightMode.RETURN)))
    told.see(2.0, mission_state=MissionState.COMPLETE, landed=LandedState.ON_GROUND)


@pytest.mark.parametrize(
    ("asked", "last"), [(RunAction.RETURN, RunState.ABORTED), (RunAction.CONTINGENCY, RunState.ABORTED)]
)
def test_a_return_that_was_commanded_flies_no_item_of_the_rest(asked: RunAction, last: RunState) -> None:
    told = on_its_way_out()
    flown = told.run.flown_item_ids
    told.command(asked)
    return_along(told)
    told.disarm(FlightMode.HOLD)
    assert told.run.state is last
    assert told.run.flown_item_ids == flown
    assert told.run.drops[0].outcome is DropOutcome.KEPT


@pytest.mark.parametrize("in_failsafe", [True, False])
def test_a_return_by_a_failsafe_or_a_pilot_completes_no_mission(in_failsafe: bool) -> None:
    told = on_its_way_out()
    flown = told.run.flown_item_ids
    told.see(in_failsafe=in_failsafe, mode=FlightMode.RETURN)
    return_along(told)
    told.disarm(FlightMode.HOLD)
    assert told.run.state is RunState.FAILED
    assert told.run.flown_item_ids == flown


def test_a_landing_that_is_reported_after_the_return_was_left_counts_no_more() -> None:
    told = on_its_way_out()
    flown = told.run.flown_item_ids
    told.command(RunAction.RETURN)
    return_along(told)
    told.see(0.5, mode=FlightMode.HOLD)
    told.feed(FactReceived(told.observed, ItemReached(LANDING_SEQ, FlightMode.HOLD)))
    assert told.run.flown_item_ids == flown


def test_a_return_that_is_found_after_a_loss_of_the_link_completes_no_mission() -> None:
    told = on_its_way_out()
    told.see(2.0, mode=FlightMode.RETURN, in_failsafe=True)
    told.see(20.0, connected=False)
    landed = {"landed": LandedState.ON_GROUND, "mission_state": MissionState.COMPLETE}
    told.see(5.0, connected=True, mission_seq=LANDING_SEQ, **landed)
    told.disarm(FlightMode.HOLD)
    assert told.run.state is RunState.FAILED


def test_the_missions_own_landing_counts_also_if_it_is_told_after_the_landing() -> None:
    told = on_its_way_out()
    told.see(2.0, mission_seq=LANDING_SEQ)
    told.state = replace(told.state, landed=LandedState.ON_GROUND)
    told.see(0.5, mode=FlightMode.HOLD)
    told.feed(FactReceived(told.observed, ItemReached(LANDING_SEQ, FlightMode.HOLD)))
    assert told.run.flown_item_ids[-1] == MISSION.plan_item_of[LANDING_SEQ]
