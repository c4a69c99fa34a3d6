"""A run is paused as asked only if somebody asked, also when its vehicle was in offboard control meanwhile."""

from __future__ import annotations

from app.domain.drop.record import GripperUse
from app.domain.events import EventKind
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunState
from app.domain.vehicle.state import FlightMode, LandedState
from tests.support.events import data_of
from tests.support.run_service import restarted, run_service


async def test_who_pauses_a_run_is_said_as_it_is_when_its_vehicle_was_in_offboard_control() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        await service.runs.pause(service.run_id)
        await service.until(lambda: service.run.reason == Reason.of(ReasonCode.PAUSED_AS_ASKED), "it was asked for")
        await service.vehicle.enter_offboard()
        await service.until(lambda: service.run.reason == Reason.of(ReasonCode.OFFBOARD), "it must be told")
        service.vehicle.put(mode=FlightMode.HOLD, in_failsafe=True)  # the stream has ended, and nobody asked for this
        await service.until(
            lambda: service.run.reason == Reason.of(ReasonCode.AFTER_OFFBOARD_FAILSAFE), "the vehicle says so"
        )
        service.vehicle.put(in_failsafe=False)
        after = Reason.of(ReasonCode.AFTER_OFFBOARD)
        await service.until(lambda: service.run.reason == after, "nobody asked for this pause")
        await service.vehicle.enter_offboard()
        await service.until(lambda: service.run.reason == Reason.of(ReasonCode.OFFBOARD), "it must be told again")
        await service.runs.pause(service.run_id)
        await service.until(lambda: service.run.reason == Reason.of(ReasonCode.PAUSED_AS_ASKED), "this was asked for")
        reasons = [data_of(event)["reason"] for event in service.events.events if event.kind == EventKind.RUN_CHANGED]
        assert reasons.count(after.model_dump(mode="json")) == 1, "nothing else was said on the way out"


async def test_a_gripper_that_a_task_is_about_to_use_is_stored_with_the_run_and_survives_a_restart() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(mission_seq=1, landed=LandedState.IN_AIR)
        await service.runs.pause(service.run_id)
        await service.runs.use_gripper(service.run_id)
        stored = [data_of(event) for event in service.events.events if event.kind == EventKind.RUN_DROP]
        assert stored[-1]["gripper_used_by"] == "task", "stored when it returns"
        await restarted(service)
        assert service.run.drops[0].gripper_used_by is GripperUse.TASK


async def test_after_a_restart_a_run_in_offboard_control_until_then_is_not_said_to_be_paused_as_asked() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(mission_seq=1, landed=LandedState.IN_AIR)
        await service.runs.pause(service.run_id)
        await service.vehicle.enter_offboard()
        await service.until(lambda: service.run.reason == Reason.of(ReasonCode.OFFBOARD), "it must be told")
        await restarted(service, meanwhile=lambda: service.vehicle.put(mode=FlightMode.HOLD))
        after = Reason.of(ReasonCode.AFTER_OFFBOARD)
        await service.until(lambda: service.run.reason == after, "the process that flew it is gone")
