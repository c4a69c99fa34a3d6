"""A run ends in a known state, and nothing is started or dropped that should not be."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest

from app.domain.drop.record import Certainty, DropOutcome
from app.domain.errors import (
    ConflictError,
    LinkTimeoutError,
    NotFoundError,
    StorageError,
    UploadError,
    VehicleBusyError,
    VehicleRefusedError,
    WrongStateError,
)
from app.domain.events import EventKind
from app.domain.events.run import CommandOutcome, RunAck
from app.domain.flight import step
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.run.run import RunState
from app.domain.vehicle.commands import MavResult
from app.domain.vehicle.facts import DuplicateSystem, Rebooted
from app.domain.vehicle.state import FlightMode, LandedState, MissionState
from tests.support.events import data_of
from tests.support.run_service import RunService, run_service
from tests.support.scripted_link import FAST


async def land(service: RunService, *, complete: bool = True, over: bool = True) -> None:
    service.vehicle.touch_down(complete=complete, last_seq=len(service.mission.items) - 1)
    if over:
        await service.until(lambda: is_known_to_be_over(service), "the run must end after the landing")


def is_known_to_be_over(service: RunService) -> bool:
    """Whether it is told so; the fake store has it a moment before."""
    return service.run.is_over and all(run.is_over for run in service.runs.open_runs())


def outcomes(service: RunService) -> list[tuple[CommandOutcome, str]]:
    """Of the commands to the run."""
    return [(one.data.outcome, one.data.detail) for one in service.events.events if isinstance(one.data, RunAck)]


async def test_a_delivery_is_uploaded_started_dropped_resumed_and_completed() -> None:
    async with run_service() as service:
        await service.create()
        await service.fly_to_drop()
        await service.until(lambda: service.drop.outcome is DropOutcome.RELEASED, "the parcel must be released")
        assert service.drop.certainty is Certainty.ACKNOWLEDGED
        assert service.vehicle.sent == ["wait_ready", "DO_GRIPPER 1", "set_current 0", "arm", "start", "set_current 3"]
        await land(service)
        assert service.run.state is RunState.COMPLETED
        assert service.run.flown_item_ids == ("takeoff", "corner", "clinic", "drop", "home")
        service.vehicle.put(mode=FlightMode.HOLD)
        assert (await service.create(start=False)).id != "", "the vehicle is free as soon as the end can be known"


async def test_a_report_that_the_mission_is_done_may_come_after_the_disarming(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(step, "LAST_REPORTS_S", 30.0)
    async with run_service() as service:
        await service.create()
        await service.fly_to_drop()
        await service.until(lambda: service.drop.outcome is DropOutcome.RELEASED, "the parcel must be released")
        await land(service, complete=False, over=False)
        await service.until_state(RunState.LANDED)
        service.vehicle.put(mission_state=MissionState.COMPLETE, mission_seq=len(service.mission.items) - 1)
        await service.until(lambda: service.run.is_over, "the run must end with the report")
        assert service.run.state is RunState.COMPLETED


async def test_a_release_is_stored_before_it_is_sent() -> None:
    async with run_service() as service:
        await service.create()
        await service.fly_to_drop()
        await service.until(lambda: bool(service.vehicle.releases), "the release must be sent")
        commands = [
            e
            for e in service.events.events
            if e.kind is EventKind.RUN_COMMAND and data_of(e)["command"] == "DO_GRIPPER"
        ]
        assert any(data_of(e).get("attempt") == 1 for e in commands)
        assert service.drop.attempts >= 1


async def test_no_release_is_sent_while_the_journal_cannot_store_it() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.events.refuse = lambda event: StorageError("disk full")
        await service.fly_to_drop()
        await service.until(lambda: not service.journal.healthy, "the journal must fail")
        service.vehicle.put(mission_seq=3)
        service.events.refuse = lambda event: None
        await service.until(
            lambda: service.drop.outcome is not DropOutcome.PENDING, "the drop must end when the disk is back"
        )
        assert service.vehicle.releases == []
        assert service.drop.outcome is DropOutcome.KEPT


async def test_an_upload_that_fails_starts_nothing() -> None:
    async with run_service() as service:
        service.vehicle.upload_error = UploadError("item 2 was refused", item_seq=2)
        await service.create()
        await service.until_state(RunState.FAILED)
        assert service.vehicle.sent == []
        assert "item 2" in describe(service.run.reason)
        assert service.drop.outcome is DropOutcome.KEPT


async def test_an_abort_during_the_upload_ends_the_transfer() -> None:
    async with run_service() as service:
        service.vehicle.upload_gate.clear()
        await service.create()
        await service.until(lambda: "run.upload_progress" in service.kinds(), "the upload must begin")
        await service.runs.abort(service.run_id)
        await service.until_state(RunState.ABORTED)
        assert service.vehicle.upload_closed
        assert service.vehicle.sent == []


async def test_arming_is_tried_again_until_the_vehicle_is_armable() -> None:
    async with run_service(settings=replace(FAST, armable_s=30.0)) as service:
        service.vehicle.arm_refusals = 2
        await service.create()
        await service.until_state(RunState.FLYING)
        assert service.vehicle.sent.count("arm") == 3


async def test_what_the_vehicle_says_stands_once_in_the_reason() -> None:
    async with run_service() as service:
        service.vehicle.infeasible = 1
        await service.create()
        await service.until_state(RunState.FAILED)
        assert describe(service.run.reason) == "the mission is infeasible: Geofence violation"


async def test_a_start_that_fails_on_the_ground_disarms() -> None:
    async with run_service() as service:
        service.vehicle.start_error = VehicleRefusedError("Mission start denied! No valid mission")
        await service.create()
        await service.until_state(RunState.FAILED)
        assert service.vehicle.sent[-1] == "disarm"
        assert not service.vehicle.truth.armed
        assert "denied" in describe(service.run.reason)


async def test_a_start_asked_later_may_fail_and_be_asked_again() -> None:
    async with run_service() as service:
        service.vehicle.start_error = VehicleRefusedError("not now")
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        assert "arm" not in service.vehicle.sent, "an upload alone must not arm"
        await service.runs.start(service.run_id)
        await service.until(lambda: "not now" in describe(service.run.reason), "the failed start must be told")
        assert service.run.state is RunState.UPLOADED
        service.vehicle.start_error = None
        await service.runs.start(service.run_id)
        await service.until_state(RunState.FLYING)


async def test_a_second_run_of_a_vehicle_is_refused() -> None:
    async with run_service() as service:
        await service.create()
        with pytest.raises(VehicleBusyError):
            await service.runs.create("plan-1", "v1", start=True, actor="test")


async def test_a_vehicle_that_somebody_else_armed_is_left_alone() -> None:
    async with run_service() as service:
        service.vehicle.put(armed=True)
        with pytest.raises(ConflictError):
            await service.create()
        assert service.fleet.view("v1").run_id is None


async def test_a_quarantined_vehicle_gets_no_run() -> None:
    async with run_service() as service:
        service.vehicle.put(DuplicateSystem(Reason.of(ReasonCode.TWO_CLOCKS)))
        with pytest.raises(ConflictError, match="quarantined"):
            await service.create()


async def test_unknown_plans_and_vehicles_are_named() -> None:
    async with run_service() as service:
        with pytest.raises(NotFoundError, match="v9"):
            await service.runs.create("plan-1", "v9", start=True, actor="test")
        with pytest.raises(NotFoundError, match="plan-9"):
            await service.runs.create("plan-9", "v1", start=True, actor="test")


async def test_a_lost_ack_is_retried_and_a_refusal_keeps_the_parcel() -> None:
    async with run_service() as service:
        service.vehicle.answers = [LinkTimeoutError("no ack"), [MavResult.FAILED]]
        await service.create()
        await service.fly_to_drop()
        await service.until(lambda: service.drop.outcome is not DropOutcome.PENDING, "the drop must end")
        assert len(service.vehicle.releases) == 2
        assert service.drop.outcome is DropOutcome.UNKNOWN, "the first release may have acted"


async def test_after_a_failed_drop_the_plan_decides() -> None:
    async with run_service() as service:
        service.vehicle.answers = [[MavResult.FAILED]]
        await service.create()
        await service.fly_to_drop()
        await service.until_state(RunState.RETURNING)
        assert service.vehicle.sent[-1] == "return"
        await land(service, complete=False)
        assert service.run.state is RunState.ABORTED
        assert service.drop.outcome is DropOutcome.KEPT


async def test_after_a_failed_drop_it_holds_if_the_plan_says_so_and_is_resumed() -> None:
    async with run_service(changes=lambda plan: plan.update(contingency={"on_drop_failure": "hold"})) as service:
        service.vehicle.answers = [[MavResult.FAILED]]
        await service.create()
        await service.fly_to_drop()
        await service.until_state(RunState.PAUSED)
        assert service.vehicle.sent[-1] == "hold"
        assert service.run.reason == Reason.of(ReasonCode.HOLDING_AFTER_FAILED_DROP), "nobody paused it"
        await service.runs.pause(service.run_id)
        await service.until(lambda: service.run.reason == Reason.of(ReasonCode.PAUSED_AS_ASKED), "now somebody has")
        await service.runs.resume(service.run_id)
        at = service.mission.drops[0].resume_seq
        assert service.vehicle.sent[-2:] == [f"set_current {at}", "start"], "it does not wait out the hold again"
        await service.until_state(RunState.FLYING)
        await land(service)
        assert (service.run.state, service.drop.outcome) == (RunState.COMPLETED, DropOutcome.KEPT)


async def test_a_failed_drop_goes_on_if_the_plan_says_so() -> None:
    async with run_service(changes=lambda plan: plan.update(contingency={"on_drop_failure": "continue"})) as service:
        service.vehicle.answers = [[MavResult.FAILED]]
        await service.create()
        await service.fly_to_drop()
        await service.until(lambda: service.vehicle.sent[-1] == "set_current 3", "the mission must go on")
        await land(service)
        assert service.run.state is RunState.COMPLETED
        assert service.drop.outcome is DropOutcome.KEPT


async def test_another_pilots_mode_freezes_the_run() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        before = list(service.vehicle.sent)
        service.vehicle.put(mode=FlightMode.POSITION, landed=LandedState.IN_AIR)
        await service.until_state(RunState.PAUSED)
        await service.until(
            lambda: "another client or pilot" in describe(service.run.reason), "nobody else can have done it"
        )
        assert service.vehicle.sent == before, "Waydrop never fights for a mode"


async def test_pause_and_resume() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        await service.runs.pause(service.run_id)
        await service.until_state(RunState.PAUSED)
        await service.runs.resume(service.run_id)
        await service.until_state(RunState.FLYING)
        with pytest.raises(WrongStateError):
            await service.runs.resume(service.run_id)


async def test_a_command_that_is_broken_off_was_not_asked_for_and_its_result_is_not_known() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        asked = service.run.commanded
        service.vehicle.hold_gate.clear()
        pausing = asyncio.ensure_future(service.runs.pause(service.run_id))
        await service.until(lambda: service.vehicle.sent[-1] == "hold", "it must be commanded")
        pausing.cancel()
        await asyncio.wait({pausing})
        service.vehicle.put(mode=FlightMode.LAND)
        await service.until(
            lambda: (CommandOutcome.UNKNOWN, "broken off") in outcomes(service), "it is recorded with what comes next"
        )
        assert service.run.commanded == asked


async def test_a_failsafe_that_lands_the_vehicle_on_its_last_leg_completes_nothing() -> None:
    async with run_service(changes=lambda plan: plan.update(contingency={"on_drop_failure": "continue"})) as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(mission_seq=len(service.mission.items) - 1, landed=LandedState.IN_AIR)
        await service.until(lambda: service.run.item_id == "home", "the last leg must show")
        service.vehicle.put(mode=FlightMode.LAND)
        await service.until_state(RunState.RETURNING)
        service.vehicle.put(mission_state=MissionState.COMPLETE, landed=LandedState.ON_GROUND)
        before = service.vehicle.looks
        await service.until(lambda: service.vehicle.looks > before + 3, "the touch-down must be looked at")
        service.vehicle.put(armed=False, mode=FlightMode.HOLD)
        await service.until(lambda: service.run.is_over, "the run must end")
        assert service.run.state is RunState.FAILED


async def test_a_return_asked_for_ends_aborted_with_the_parcel_kept() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(landed=LandedState.IN_AIR)
        await service.runs.return_to_launch(service.run_id)
        await service.until_state(RunState.RETURNING)
        await land(service, complete=False)
        assert service.run.state is RunState.ABORTED
        assert service.drop.outcome is DropOutcome.KEPT


async def test_a_reboot_in_flight_fails_the_run_and_starts_nothing_again() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        before = list(service.vehicle.sent)
        service.vehicle.put(Rebooted(), armed=False, mission_seq=0)
        await service.until_state(RunState.FAILED)
        assert "rebooted" in describe(service.run.reason)
        assert service.vehicle.sent == before


async def test_a_vehicle_not_heard_any_more_is_lost_in_the_end() -> None:
    async with run_service(settings=replace(FAST, lost_after_s=0.3)) as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(connected=False)
        await service.until_state(RunState.LOST)
        assert service.drop.outcome is DropOutcome.KEPT
