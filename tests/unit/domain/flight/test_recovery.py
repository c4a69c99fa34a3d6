"""A flight that is killed at any look and taken up again ends as one that never died, or safely. See decision 27."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from typing import Final

import pytest

from app.domain.autopilot.declared import default_facts
from app.domain.drop.record import Certainty, DropOutcome, DropPhase, OutputEvidence
from app.domain.flight.flight import DEFAULT_MAX_OFFSET_M, LOST_AFTER_S, Flight
from app.domain.flight.inputs import Observation, Observed, Recovered
from app.domain.flight.recovery import CarriedItems, carried_mission, ended_unseen, taken_over
from app.domain.flight.segment import drop_records, segment_of
from app.domain.flight.snapshot import ReleaseCommand
from app.domain.flight.step import step
from app.domain.mission import MavCmd, mission_hash
from app.domain.plan import parse_plan
from app.domain.plan.compiler import compile_plan
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import Run, RunState, TakenOver
from app.domain.vehicle.state import LandedState, VehicleType
from tests.support.flown_flights import (
    BEGAN_AT,
    BEGAN_S,
    DROP,
    MISSION,
    MISSION_ID,
    PLAN,
    Flown,
    a_run,
    deaths,
    prefixes,
)
from tests.support.plan_pieces import RETURN, gripper, plan_json, takeoff, waypoint

SAFE_DIFFERENCES: Final = {
    (RunState.COMPLETED, DropOutcome.RELEASED, Certainty.INFERRED): "the ack was lost: the output alone tells",
    (RunState.ABORTED, DropOutcome.KEPT, Certainty.INFERRED): "the hold's end is not known: the plan's contingency",
    (
        RunState.COMPLETED,
        DropOutcome.KEPT,
        Certainty.INFERRED,
    ): "the hold was over: the mission went on",
    (
        RunState.COMPLETED,
        DropOutcome.UNKNOWN,
        Certainty.NONE,
    ): "a release is on record, and nothing tells whether it left",
}
"""What may be otherwise at the end, and why. Decision 27 says why each of them is safe."""


def outcome(run: Run) -> tuple[RunState, DropOutcome, Certainty]:
    """What a dispatcher is told at the end."""
    return run.state, run.drops[0].outcome, run.drops[0].certainty


def test_it_flies_to_its_end() -> None:
    run = Flown().to_the_end()
    assert outcome(run) == (RunState.COMPLETED, DropOutcome.RELEASED, Certainty.ACKNOWLEDGED)
    assert run.flown_item_ids == ("takeoff", "corner", "clinic", "drop", "home")


def ends(killed: Iterable[Flown], down_s: float) -> Counter[str]:
    """How often each end came, of flights that were killed, taken up again after `down_s`, and flown to their end."""
    lived, found = outcome(Flown().to_the_end()), Counter[str]()
    for flown in killed:
        died = flown.restarted(down_s)
        end = outcome(died.to_the_end())
        found["the same" if end == lived else SAFE_DIFFERENCES.get(end, f"{end}, killed at {flown.now_s:.1f}")] += 1
        has_left, drop = died.released_s is not None, died.run.drops[0]
        assert drop.outcome in ({DropOutcome.RELEASED} if has_left else {DropOutcome.KEPT, DropOutcome.UNKNOWN}), drop
        again = [command for command in died.commands if isinstance(command, ReleaseCommand)]
        assert not (flown.released_s and again), "a release that left is never sent again"
    assert {*found} <= {"the same", *SAFE_DIFFERENCES.values()}
    return found


@pytest.mark.parametrize("down_s", [0.0, 3.0, 40.0])
def test_killed_at_any_look_and_taken_up_it_ends_as_if_it_had_never_died_or_safely(down_s: float) -> None:
    found = ends(prefixes(Flown()), down_s)
    if down_s == 0.0:
        assert found["the same"] > 0.9 * found.total(), found


@pytest.mark.parametrize("down_s", [0.0, 3.0, 40.0])
def test_killed_after_any_event_of_the_journal_it_ends_as_if_it_had_never_died_or_safely(down_s: float) -> None:
    journal = Flown()
    killed = deaths(journal)
    assert {len(flown.recorded) for flown in killed} >= {*range(1, len(journal.recorded) + 1)}, "no event is left out"
    ends(killed, down_s)


@pytest.mark.parametrize(("down_s", "untold"), [(5.0, 2), (5.0, 1000), (40.0, 1000)])
def test_taken_over_by_a_gateway_that_learnt_less_no_release_is_sent_twice_and_no_outcome_is_wrong(
    down_s: float, untold: int
) -> None:
    released = 0
    for flown in [*prefixes(Flown())][::2]:
        over = flown.taken_over(down_s, untold)
        over.to_the_end()
        drop, again = over.run.drops[0], [one for one in over.commands if isinstance(one, ReleaseCommand)]
        assert not (flown.released_s and again), f"a release that left is sent again, killed at {flown.now_s:.1f}"
        left = {DropOutcome.RELEASED, DropOutcome.UNKNOWN}
        stayed = {DropOutcome.KEPT, DropOutcome.UNKNOWN}
        assert drop.outcome in (stayed if over.released_s is None else left), (drop, flown.now_s)
        released += len(again)
    assert released or down_s == 40.0, "a drop that is surely still ahead is carried out"


def test_a_run_taken_over_whose_vehicle_is_not_found_leaves_its_drops_unknown() -> None:
    taken = TakenOver(gateway="gw-2", from_gateway="gw-1", number=1, at=1.0)
    reason = Reason.of(ReasonCode.NOT_SEEN_AFTER_RESTART)
    for found, expected in ((True, DropOutcome.KEPT), (False, DropOutcome.UNKNOWN)):
        run = a_run().model_copy(update={"taken_over": taken.model_copy(update={"is_found": found})})
        assert ended_unseen(run, RunState.LOST, reason, 2.0).drops[0].outcome is expected


def test_taken_over_on_its_way_back_to_a_drop_it_had_left_it_sends_no_second_release() -> None:
    flown = Flown()
    while flown.released_s is None:
        flown.tick()
    flown.seq, flown.at_item_s, flown.attempt = DROP.hold_seqs[0], 0.0, 0  # a person returned it, and resumes
    over = flown.taken_over(0.5, 1000)
    over.to_the_end()
    assert [one for one in over.commands if isinstance(one, ReleaseCommand)] == []
    assert over.run.drops[0].outcome is not DropOutcome.KEPT


@pytest.mark.parametrize(
    "seen", [{"armed": False}, {"landed": LandedState.ON_GROUND}, {"mission_seq": None}, {"armed": None}]
)
def test_taken_over_when_it_may_have_landed_already_its_drops_may_have_been_commanded(seen: dict[str, object]) -> None:
    taken = TakenOver(gateway="gw-2", from_gateway="gw-1", number=1, at=1.0)
    run = a_run().model_copy(update={"taken_over": taken})
    flies = replace(Flown().state, mission_seq=0)
    assert taken_over(run, MISSION, flies).drops[0].attempts == 0
    assert taken_over(run, MISSION, replace(flies, **seen)).drops[0].attempts == 1  # type: ignore[arg-type]


@pytest.mark.parametrize("is_taken_over", [True, False])
@pytest.mark.parametrize(
    ("beyond", "outcome"), [(0, DropOutcome.KEPT), (1, DropOutcome.UNKNOWN), (2, DropOutcome.UNKNOWN)]
)
def test_a_gripper_that_a_later_grab_closed_is_no_proof_that_the_parcel_was_kept(
    is_taken_over: bool, beyond: int, outcome: DropOutcome
) -> None:
    """The first release may have left when its gateway died; the vehicle flies on past the pick-up of the next one."""
    items = takeoff(12), waypoint(30, 0, 12), gripper(), waypoint(60), gripper(action="grab"), waypoint(90), gripper()
    plan = parse_plan(plan_json("multicopter", *items, RETURN))
    mission = compile_plan(plan, default_facts(VehicleType.MULTICOPTER))
    grab_seq = next(item.seq for item in mission.items if item.command is MavCmd.DO_GRIPPER)
    drops = drop_records(mission)
    assert drops[0].supervised
    flies = replace(Flown().state, mission_seq=grab_seq - 1 + beyond, gripper_output_us=2000)
    if is_taken_over:
        taken = TakenOver(gateway="gw-2", from_gateway="gw-1", number=1, at=1.0)
        run = taken_over(a_run().model_copy(update={"drops": drops, "taken_over": taken}), mission, flies)
    else:
        commanded = drops[0].model_copy(update={"attempts": 1, "commanded_at": BEGAN_AT, "phase": DropPhase.RELEASING})
        run = a_run().model_copy(update={"drops": (commanded, *drops[1:])})
    segment = segment_of(run, plan, mission, DEFAULT_MAX_OFFSET_M, {})
    flight = Flight.of(run, segment, BEGAN_S, LOST_AFTER_S, DEFAULT_MAX_OFFSET_M)
    seen = Observation(flies, BEGAN_S, BEGAN_AT)
    flight, _ = step(flight, Recovered(seen, in_flight=True, flown=(), current=flies.mission_seq))
    for tick in range(30):
        flight, _ = step(flight, Observed(replace(seen, now_s=BEGAN_S + 0.1 * tick, time_s=BEGAN_AT + 0.1 * tick)))
    assert flight.run.drops[0].outcome is outcome
    evidence = flight.run.drops[0].output_evidence
    assert (evidence is OutputEvidence.NOT_MOVED) is (outcome is DropOutcome.KEPT and not is_taken_over)


def test_a_run_taken_over_before_its_start_was_told_is_not_known_to_have_kept_its_parcels() -> None:
    taken = TakenOver(gateway="gw-2", from_gateway="gw-1", number=1, at=1.0)
    run = a_run().model_copy(update={"taken_over": taken, "state": RunState.UPLOADED})
    ended = ended_unseen(run, RunState.FAILED, Reason.of(ReasonCode.TAKEN_OVER_BEFORE_START), 2.0)
    assert ended.drops[0].outcome is DropOutcome.UNKNOWN


@pytest.mark.parametrize(
    ("run_id", "named", "checksum", "digest", "is_known"),
    [
        (MISSION_ID, MISSION_ID, MISSION_ID, mission_hash(MISSION), True),
        (MISSION_ID, MISSION_ID, MISSION_ID, "of another fence", False),
        (MISSION_ID, MISSION_ID, MISSION_ID, None, False),
        (MISSION_ID, MISSION_ID, 8, mission_hash(MISSION), False),
        (MISSION_ID, 8, MISSION_ID, mission_hash(MISSION), False),
        (MISSION_ID, None, MISSION_ID, mission_hash(MISSION), False),
        (None, None, MISSION_ID, mission_hash(MISSION), False),
    ],
)
def test_a_mission_is_known_unread_only_if_its_id_its_checksum_and_its_hash_are_those_of_the_upload(
    run_id: int | None, named: int | None, checksum: int, digest: str | None, is_known: bool
) -> None:
    run = a_run().model_copy(update={"mission_id": run_id, "mission_hash": digest})
    told = CarriedItems(named, None, lambda mission: checksum)
    found = carried_mission(run, PLAN, None, default_facts(VehicleType.MULTICOPTER), told)
    assert (found is not None) is is_known
    assert found is None or found.mission == MISSION
