"""What users command on the return at a plan's end, and of a vehicle that has landed."""

from __future__ import annotations

import asyncio

import pytest

from app.domain.errors import ConflictError, VehicleTakenError
from app.domain.events.run import CommandOutcome, RunAck, RunCommandName
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunState
from app.domain.vehicle.facts import ItemReached
from app.domain.vehicle.state import FlightMode, LandedState, MissionState, SignalDurations
from tests.support.changed_flight import fly
from tests.support.run_service import RunService, run_service

AGREED = SignalDurations(disarmed_s=60.0, on_ground_s=60.0, at_rest_s=60.0)
MISSION_DONE = Reason.of(ReasonCode.MISSION_DONE)


async def returning(service: RunService) -> None:
    """On the return at the plan's end."""
    await fly(service, "clinic")
    seq = service.mission.seqs_of("home")[0]
    service.vehicle.put(ItemReached(seq), mode=FlightMode.RETURN, mission_seq=seq, mission_state=MissionState.COMPLETE)
    await service.until(lambda: service.run.reason == MISSION_DONE, "it flies home")


async def paused_on_return(service: RunService) -> None:
    await returning(service)
    await service.runs.pause(service.run_id)
    await service.until_state(RunState.PAUSED)


async def test_a_resumed_return_is_commanded_as_a_return() -> None:
    async with run_service() as service:
        await paused_on_return(service)
        await service.runs.resume(service.run_id)
        assert service.vehicle.sent[-2:] == ["hold", "return"], "PX4 does not enter Mission mode any more"
        await service.until_state(RunState.RETURNING)
        assert (service.run.reason, service.newest.commanded) == (MISSION_DONE, None)
        service.vehicle.touch_down(complete=True, last_seq=len(service.mission.items) - 1)
        await service.until_state(RunState.COMPLETED)


async def test_two_resumes_at_once_are_one_return() -> None:
    async with run_service() as service:
        await paused_on_return(service)
        resumed = await asyncio.gather(*[service.runs.resume(service.run_id) for _ in range(2)])
        assert {run.state for run in resumed} <= {RunState.PAUSED, RunState.RETURNING}
        await service.until_state(RunState.RETURNING)


async def test_a_return_is_not_resumed_against_a_pilot_who_came_first() -> None:
    async with run_service() as service:
        await paused_on_return(service)
        service.events.pause()
        resuming = asyncio.create_task(service.runs.resume(service.run_id))
        await service.until(lambda: service.newest.commanded == "resume", "it is commanded")
        service.vehicle.put(mode=FlightMode.POSITION)
        service.events.open.set()
        with pytest.raises(VehicleTakenError):
            await resuming
        assert service.vehicle.sent[-1] == "hold"


async def test_a_landing_commanded_on_the_return_aborts_the_run() -> None:
    async with run_service() as service:
        await returning(service)
        await service.runs.land(service.run_id)
        service.vehicle.put(armed=False, landed=LandedState.ON_GROUND)
        await service.until_state(RunState.ABORTED)
        assert service.run.reason == Reason.of(ReasonCode.ASKED_BEFORE_DONE, asked="land")


@pytest.mark.parametrize("asked", ["abort", "return_to_launch", "land"])
async def test_a_vehicle_that_has_landed_and_disarmed_is_commanded_no_mode(asked: str) -> None:
    async with run_service() as service:
        await fly(service)
        service.vehicle.put(mode=FlightMode.OTHER, in_failsafe=True)
        await service.until_state(RunState.PAUSED)
        unsure = SignalDurations(disarmed_s=0.5, on_ground_s=0.5, at_rest_s=0.5)
        service.vehicle.put(mode=FlightMode.MISSION, armed=False, landed=LandedState.ON_GROUND, durations=unsure)
        sent = list(service.vehicle.sent)
        asking = asyncio.create_task(getattr(service.runs, asked)(service.run_id))
        await asyncio.sleep(0)
        service.vehicle.put(durations=AGREED)
        await asking
        await service.until_state(RunState.FAILED)
        because = Reason.of(ReasonCode.ENDED_EARLY_BECAUSE, Reason.of(ReasonCode.FAILSAFE_MODE, mode="other"))
        assert (service.run.reason, service.vehicle.sent) == (because, sent)
        acks = [event.data for event in service.events.events if isinstance(event.data, RunAck)]
        told = {ack.outcome for ack in acks if ack.command in (RunCommandName.RETURN, RunCommandName.LAND)}
        assert told <= {CommandOutcome.NOT_SENT}, "it is told unless the run was over before"


async def test_a_vehicle_that_only_seems_to_have_landed_is_sent_home_all_the_same() -> None:
    async with run_service() as service:
        await fly(service)
        flies = SignalDurations(disarmed_s=0.5, on_ground_s=0.5, at_rest_s=0.0)
        service.vehicle.put(armed=False, landed=LandedState.ON_GROUND, durations=flies)
        await service.runs.abort(service.run_id)
        assert service.vehicle.sent[-1] == "return"


async def test_an_abort_is_sent_to_a_vehicle_whose_arming_the_run_has_not_seen() -> None:
    """A HEARTBEAT of before the arming, which came late, is the newest."""
    async with run_service() as service:

        async def wait_armed() -> None:
            service.vehicle.put(armed=False)

        service.vehicle.wait_armed = wait_armed  # type: ignore[method-assign]
        service.vehicle.says_armed = False
        service.vehicle.put(durations=AGREED)
        await service.create()
        await service.until_state(RunState.FLYING)
        await service.runs.abort(service.run_id)
        assert service.vehicle.sent[-1] == "return"


async def test_a_disarmed_vehicle_on_the_ground_is_not_resumed() -> None:
    async with run_service() as service:
        await fly(service)
        await service.runs.pause(service.run_id)
        await service.until_state(RunState.PAUSED)
        unsure = SignalDurations(disarmed_s=0.5, on_ground_s=0.5, at_rest_s=0.5)
        service.vehicle.put(armed=False, landed=LandedState.ON_GROUND, durations=unsure)
        with pytest.raises(ConflictError, match="disarmed on the ground"):
            await service.runs.resume(service.run_id)
        assert service.vehicle.sent[-1] == "hold"
