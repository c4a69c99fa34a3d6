"""A supervised drop's record notes the gripper's output only as evidence of its own release."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.autopilot.declared import default_facts
from app.domain.drop.record import Certainty, DropOutcome, DropPhase, DropRecord, OutputEvidence
from app.domain.drop.supervised_inputs import Finish
from app.domain.flight.progress import MissionProgress
from app.domain.flight.recovery import ended_unseen
from app.domain.flight.snapshot import VehicleSnapshot, finished, output_evidence
from app.domain.flight.supervised_release import SupervisedRelease
from app.domain.mission import CompiledDrop, MavCmd
from app.domain.plan import parse_plan
from app.domain.plan.compiler import compile_plan
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.run.run import Run, RunState
from app.domain.vehicle.commands import CommandAck, MavResult
from app.domain.vehicle.state import FlightMode, LandedState, VehicleState, VehicleType
from tests.support.paths import PLANS
from tests.support.reasons import some

MISSION = compile_plan(parse_plan((PLANS / "clinic-run.json").read_text()), default_facts(VehicleType.MULTICOPTER))
DROP = MISSION.drops[0]
COMMANDED_AT_S = 5000.0


COMMANDED = DropRecord(
    plan_item_id=DROP.plan_item_id, supervised=True, phase=DropPhase.RELEASING, attempts=1, commanded_at=COMMANDED_AT_S
)
OPENED = COMMANDED.model_copy(update={"output_us": 1000, "output_at": COMMANDED_AT_S + 0.1})


def looked_at(
    age_s: float,
    *,
    after_s: float = 10.0,
    compiled: CompiledDrop = DROP,
    record: DropRecord = COMMANDED,
    output_us: int = 1000,
) -> DropRecord:
    """The record after one look, that much later than the release was commanded."""
    release = SupervisedRelease.of(compiled, record, 2.0, "continue")
    state = VehicleState(
        connected=True,
        mode=FlightMode.MISSION,
        mission_seq=2,
        boot_time_s=60.0,
        position_age_s=0.1,
        gripper_output_us=output_us,
        gripper_output_age_s=age_s,
    )
    return release.observe(VehicleSnapshot(state, 100.0, COMMANDED_AT_S + after_s, 1.0), MissionProgress.of(MISSION))[
        0
    ].record


def test_the_output_is_noted_with_the_time_at_which_it_was_received() -> None:
    record = looked_at(1.5)
    assert (record.output_us, record.output_at) == (1000, pytest.approx(COMMANDED_AT_S + 8.5))


@pytest.mark.parametrize(("age_s", "after_s"), [(9.0, 10.0), (1.5, 1.0)])
def test_an_output_that_is_old_or_from_before_the_release_is_no_evidence(age_s: float, after_s: float) -> None:
    record = looked_at(age_s, after_s=after_s)
    assert (record.output_us, record.output_at) == (None, None)


def test_a_winch_is_not_given_the_output_of_the_gripper() -> None:
    record = looked_at(0.1, compiled=replace(DROP, command=MavCmd.DO_WINCH))
    assert record.output_us is None


@pytest.mark.parametrize("output_us", [900, 2000])
def test_after_a_restart_an_output_that_was_seen_at_release_still_counts(output_us: int) -> None:
    """It is 900 again once the vehicle has disarmed, and 2000 once somebody grabbed."""
    record = looked_at(0.1, record=OPENED, output_us=output_us)
    assert (record.outcome, record.certainty) == (DropOutcome.RELEASED, Certainty.INFERRED)
    assert (record.output_us, record.output_at) == (1000, OPENED.output_at)


def acknowledged(compiled: CompiledDrop = DROP, **state: object) -> DropRecord:
    """The record of a drop whose release was accepted with nothing seen of an output."""
    fresh = DropRecord(plan_item_id=DROP.plan_item_id, supervised=True)
    release = SupervisedRelease.of(compiled, fresh, 2.0, "continue")
    for tick in range(200):
        now_s = tick * 0.1
        away_deg = 0.001 if tick < 20 else 0.0
        place = {"latitude_deg": compiled.latitude_deg + away_deg, "longitude_deg": compiled.longitude_deg}
        seen = {"connected": True, "armed": True, "mode": FlightMode.MISSION, "mission_seq": compiled.hold_seqs[0]}
        place |= {"relative_altitude_m": compiled.relative_altitude_m}
        still = {"velocity_north_m_s": 0.0, "velocity_east_m_s": 0.0, "position_age_s": 0.1, "boot_time_s": now_s}
        flown = {"landed": LandedState.IN_AIR, **seen, **place, **still, **state}
        look = VehicleSnapshot(VehicleState(**flown), now_s, COMMANDED_AT_S + now_s, 1.0)  # type: ignore[arg-type]
        release, _ = release.observe(look, MissionProgress.of(MISSION))
        if release.record.attempts and not release.is_over:
            return release.acked(1, CommandAck(MavCmd.DO_GRIPPER, MavResult.ACCEPTED), look)[0].record
    raise AssertionError("no release was sent")


@pytest.mark.parametrize(
    ("has_output", "evidence"),
    [
        (False, OutputEvidence.NOT_ASSIGNED),
        (None, OutputEvidence.NOT_KNOWN),
        (True, OutputEvidence.NOT_SEEN),
    ],
)
def test_an_ack_alone_is_released_and_says_in_a_word_that_no_output_was_seen_to_move(
    has_output: bool | None, evidence: OutputEvidence
) -> None:
    record = acknowledged(has_gripper_output=has_output)
    assert (record.outcome, record.certainty) == (DropOutcome.RELEASED, Certainty.ACKNOWLEDGED)
    assert (record.output_evidence, record.rests_on_an_ack_alone) == (evidence, True)
    assert record.reason == Reason.of(ReasonCode.DROP_ACKNOWLEDGED_NO_MOVE)


def test_a_winch_says_nothing_of_an_output() -> None:
    record = acknowledged(replace(DROP, command=MavCmd.DO_WINCH), has_gripper_output=False)
    assert (record.output_evidence, record.rests_on_an_ack_alone, record.reason) == (
        *(None, False, Reason.of(ReasonCode.DROP_ACKNOWLEDGED)),
    )


def test_before_the_release_it_is_said_that_no_output_is_assigned() -> None:
    release = SupervisedRelease.of(DROP, DropRecord(plan_item_id="drop", supervised=True), 2.0, "continue")
    unassigned = VehicleSnapshot(VehicleState(connected=True, has_gripper_output=False), 1.0, 1.0, 1.0)
    release, _ = release.observe(unassigned, MissionProgress.of(MISSION))
    assert release.record.output_evidence is OutputEvidence.NOT_ASSIGNED
    release, _ = release.observe(
        VehicleSnapshot(VehicleState(connected=True), 2.0, 2.0, 1.0), MissionProgress.of(MISSION)
    )
    assert release.record.output_evidence is OutputEvidence.NOT_ASSIGNED, "after a restart it is not known at first"


@pytest.mark.parametrize(("output_us", "evidence"), [(1000, OutputEvidence.MOVED), (2000, OutputEvidence.NOT_MOVED)])
def test_what_the_output_showed_is_a_word(output_us: int, evidence: OutputEvidence) -> None:
    opened = looked_at(0.1, output_us=output_us)
    done = finished(opened, Finish(DropOutcome.UNKNOWN, Certainty.NONE, some()))
    assert output_evidence(done, DROP, VehicleState(has_gripper_output=True)) is evidence


def closed(record: DropRecord) -> DropRecord:
    """At the end of a run whose vehicle is not found again."""
    drops = (record,)
    run = Run(id="r", plan_id="p", plan_hash="h", vehicle_id="v", drops=drops, created_at=0.0, updated_at=0.0)
    run = run.model_copy(update={"state": RunState.FLYING})
    return ended_unseen(run, RunState.LOST, Reason.of(ReasonCode.NOT_SEEN_AFTER_RESTART), 1.0).drops[0]


def test_a_run_that_ends_unseen_says_released_of_a_drop_whose_output_went_to_release() -> None:
    done = closed(OPENED)
    assert (done.outcome, done.certainty) == (DropOutcome.RELEASED, Certainty.INFERRED)
    assert "moved to release" in describe(done.reason)
    assert closed(COMMANDED).outcome is DropOutcome.UNKNOWN


def test_a_drop_whose_release_was_withheld_is_not_kept_with_the_output_at_release() -> None:
    withheld = OPENED.model_copy(update={"attempts": 0, "commanded_at": None})
    assert closed(withheld).outcome is DropOutcome.UNKNOWN
    assert (closed(withheld.model_copy(update={"output_us": None}))).outcome is DropOutcome.KEPT
