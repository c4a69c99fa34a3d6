"""Commands in flight: a person's come first, and none is carried out once the vehicle is elsewhere."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.errors import VehicleRefusedError, VehicleTakenError
from app.domain.events.run import RunAck, RunCommand
from app.domain.flight.snapshot import ContingencyCommand
from app.domain.run.run import RunState
from app.domain.vehicle.commands import CommandAck, CommandRequest
from app.domain.vehicle.state import FlightMode
from tests.support.changed_flight import fly
from tests.support.run_service import RunService, run_service
from tests.support.scripted_link import FAST


class SlowCommand:
    """A command of the vehicle that is sent at once, and answered when it is told to."""

    def __init__(self, obey: Callable[[], Awaitable[None]]) -> None:
        self.is_sent, self.may_be_answered = asyncio.Event(), asyncio.Event()
        self._obey = obey

    async def __call__(self) -> None:
        self.is_sent.set()
        await self.may_be_answered.wait()
        await self._obey()


async def paused(service: RunService) -> None:
    """A run in flight that a person has paused."""
    await fly(service)
    await service.runs.pause(service.run_id)
    await service.until_state(RunState.PAUSED)


LINK_COMMANDS = {"land": "land", "pause": "hold", "return_to_launch": "return_to_launch"}


@pytest.mark.parametrize("asked", LINK_COMMANDS)
async def test_the_plans_answer_does_not_come_after_what_a_person_has_commanded(
    asked: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with run_service() as service:
        await fly(service)
        slow = SlowCommand(getattr(service.vehicle, LINK_COMMANDS[asked]))
        monkeypatch.setattr(service.vehicle, LINK_COMMANDS[asked], slow)
        order = asyncio.create_task(getattr(service.runs, asked)(service.run_id))
        await slow.is_sent.wait()
        before, commanded = list(service.vehicle.sent), service.newest.commanded
        service.flight.sender.carry_out([ContingencyCommand("return", "drop"), ContingencyCommand("hold", "drop")])
        slow.may_be_answered.set()
        await order
        assert service.newest.commanded == commanded
        assert len(service.vehicle.sent) == len(before) + 1, "nothing but the person's command"


async def test_the_plans_answer_comes_once_the_vehicle_has_refused_a_person(monkeypatch: pytest.MonkeyPatch) -> None:
    async def refused() -> None:
        raise VehicleRefusedError("denied")

    async with run_service() as service:
        await fly(service)
        slow = SlowCommand(refused)
        monkeypatch.setattr(service.vehicle, "land", slow)
        order = asyncio.create_task(service.runs.land(service.run_id))
        await slow.is_sent.wait()
        service.flight.sender.carry_out([ContingencyCommand("return", "drop")])
        await asyncio.sleep(0)
        slow.may_be_answered.set()
        with pytest.raises(VehicleRefusedError):
            await order
        await service.until(lambda: service.vehicle.sent[-1] == "return", "the plan's answer is not forgotten")


async def test_what_a_person_commands_does_not_wait_for_a_disk_that_stalls() -> None:
    async with run_service() as service:
        await fly(service)
        service.events.pause()
        orders = [asyncio.create_task(service.runs.pause(service.run_id))]
        await service.until(lambda: "hold" in service.vehicle.sent, "it holds")
        orders.append(asyncio.create_task(service.runs.land(service.run_id)))
        await service.until(lambda: service.vehicle.sent[-1] == "land", "nor for the record of the one before")
        assert not any(order.done() for order in orders), "an answer says that it is stored"
        service.events.open.set()
        await asyncio.gather(*orders)
        told = [one.data for one in service.events.events if isinstance(one.data, RunCommand | RunAck)]
        assert [(type(one), one.command.value) for one in told[-4:]] == [
            *((RunCommand, "pause"), (RunAck, "pause")),
            *((RunCommand, "land"), (RunAck, "land")),
        ]


async def test_a_second_resume_finds_the_mission_flown() -> None:
    async with run_service() as service:
        await paused(service)
        resumed = await asyncio.gather(*[service.runs.resume(service.run_id) for _ in range(2)])
        assert {run.state for run in resumed} <= {RunState.PAUSED, RunState.FLYING}
        await service.until_state(RunState.FLYING)


async def test_a_flight_is_not_resumed_after_a_return_that_was_commanded_first(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_service() as service:
        await paused(service)
        slow = SlowCommand(service.vehicle.return_to_launch)
        monkeypatch.setattr(service.vehicle, "return_to_launch", slow)
        order = asyncio.create_task(service.runs.return_to_launch(service.run_id))
        await slow.is_sent.wait()
        resuming = asyncio.create_task(service.runs.resume(service.run_id))
        await asyncio.sleep(FAST.poll_every_s)
        slow.may_be_answered.set()
        await order
        with pytest.raises(VehicleTakenError):
            await resuming
        assert service.vehicle.sent[-1] == "return"


async def test_a_vehicle_that_a_pilot_took_while_the_disk_was_waited_for_is_not_resumed() -> None:
    async with run_service() as service:
        await paused(service)
        service.events.pause()
        resuming = asyncio.create_task(service.runs.resume(service.run_id))
        await service.until(lambda: service.newest.commanded == "resume", "it is commanded")
        sent = list(service.vehicle.sent)
        service.vehicle.put(mode=FlightMode.POSITION)
        service.events.open.set()
        with pytest.raises(VehicleTakenError):
            await resuming
        assert service.vehicle.sent == sent


async def test_a_mission_is_not_moved_on_once_its_hold_may_have_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        command = service.vehicle.command

        async def read_late(request: CommandRequest) -> AsyncGenerator[CommandAck, None]:
            async for ack in command(request):
                service.vehicle.boot_ahead_s = 3600.0  # as after a standstill of the process
                yield ack

        monkeypatch.setattr(service.vehicle, "command", read_late)
        await service.fly_to_drop()
        await service.until(lambda: service.drop.outcome is DropOutcome.RELEASED, "the release is acknowledged")
        service.vehicle.touch_down(complete=True, last_seq=len(service.mission.items) - 1)
        await service.until(lambda: service.run.is_over, "the run must end")
        assert not [sent for sent in service.vehicle.sent if sent.startswith("set_current") and sent[-1] != "0"]


async def test_a_mission_that_is_resumed_after_a_return_goes_on_where_it_was() -> None:
    """With RTL_TYPE 1 to 4 a return makes the mission's landing current, and Mission mode alone would fly there."""
    async with run_service() as service:
        await fly(service)
        seq, last = service.newest.item_id, len(service.mission.items) - 1
        at = service.flight.flight.progress.current
        await service.runs.return_to_launch(service.run_id)
        service.vehicle.put(mode=FlightMode.RETURN, mission_seq=last - 1)
        await service.until_state(RunState.RETURNING)
        await service.runs.pause(service.run_id)
        service.vehicle.put(mode=FlightMode.HOLD)
        await service.until_state(RunState.PAUSED)
        assert service.newest.item_id == seq
        await service.runs.resume(service.run_id)
        assert service.vehicle.sent[-2:] == [f"set_current {at}", "start"]
