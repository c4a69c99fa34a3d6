"""While a change is under way: nothing is released, a person's command goes first, and what is on board is followed."""

from __future__ import annotations

import asyncio

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.errors import ChangeUnderWayError, LinkTimeoutError, StorageError
from app.domain.ports.stores import StoredAnswer
from tests.support.changed_flight import begun, clinic_moved, fly, store
from tests.support.events import data_of
from tests.support.run_service import restarted, run_service


async def test_no_release_is_sent_while_another_mission_is_on_its_way() -> None:
    async with run_service() as service:
        await fly(service, "clinic")
        change = await begun(service, lambda _: None)
        await service.fly_to_drop()
        before = service.vehicle.looks
        await service.until(lambda: service.vehicle.looks > before + 60, "it must be looked at")
        assert service.vehicle.releases == []
        service.vehicle.upload_gate.set()
        await change
        await service.until(
            lambda: service.drop.outcome is DropOutcome.RELEASED, "then it is released in the new mission's hold"
        )
        assert len(service.vehicle.releases) == 1


async def test_a_return_breaks_a_change_off_and_does_not_wait_for_it() -> None:
    async with run_service() as service:
        await fly(service)
        change = await begun(service)
        await service.runs.return_to_launch(service.run_id)
        assert service.vehicle.sent[-1] == "return"
        with pytest.raises(ChangeUnderWayError):
            await change
        assert (service.run.plan_id, service.vehicle.upload_closed) == ("plan-1", True)


async def test_a_change_whose_ack_is_lost_is_followed_as_soon_as_the_vehicle_names_it() -> None:
    async with run_service() as service:
        await fly(service)
        service.vehicle.lost_ack = LinkTimeoutError("the link is lost")
        with pytest.raises(LinkTimeoutError):
            await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        assert service.run.changing is not None, "nobody knows yet which mission it flies"
        assert service.run.plan_id == "plan-1"
        service.vehicle.put(mission_id=service.run.changing.mission_id, mission_seq=0)
        await service.until(lambda: service.run.plan_id == "plan-2", "the mission that is flown is followed")
        assert service.run.changing is None


async def test_a_change_that_cannot_be_recorded_is_not_sent() -> None:
    async with run_service() as service:
        await fly(service)
        on_board = service.vehicle.on_board
        service.events.refuse = lambda event: StorageError("disk full") if data_of(event).get("changing") else None
        with pytest.raises(StorageError):
            await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        assert service.vehicle.on_board == on_board
        service.events.refuse = lambda event: None


async def test_after_a_restart_the_changed_mission_is_followed() -> None:
    async with run_service() as service:
        await fly(service)
        await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        await restarted(service)
        await service.vehicle.fly_to_hold(47.398700, 8.546656, 1)
        await service.until(lambda: service.drop.outcome is DropOutcome.RELEASED, "the taken-up run must drop")
        assert service.run.flown_item_ids[:2] == ("takeoff", "corner")


@pytest.mark.parametrize("arrived", [True, False])
async def test_after_a_restart_in_the_middle_of_a_change_the_mission_on_board_is_followed(arrived: bool) -> None:
    async with run_service() as service:
        await fly(service)
        service.vehicle.lost_ack = LinkTimeoutError("killed meanwhile") if arrived else None
        service.vehicle.upload_error = None if arrived else LinkTimeoutError("killed meanwhile")
        with pytest.raises(LinkTimeoutError):
            await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        changing = service.run.changing
        assert changing is not None

        def meanwhile() -> None:
            if arrived:
                service.vehicle.put(mission_id=changing.mission_id, mission_seq=0)

        await restarted(service, meanwhile=meanwhile)
        await service.until(lambda: service.run.changing is None, "it is known again what is flown")
        assert service.run.plan_id == ("plan-2" if arrived else "plan-1")
        assert service.kinds().count("run.mission_changed") == int(arrived)
        await service.vehicle.fly_to_hold(
            47.398700 if arrived else service.mission.drops[0].latitude_deg, 8.546656, 2 - arrived
        )
        await service.until(
            lambda: service.drop.outcome is DropOutcome.RELEASED, "the drop of that mission must be made"
        )


async def test_a_vehicle_that_comes_to_its_next_item_meanwhile_is_not_taken_back() -> None:
    async with run_service() as service:
        await fly(service)
        change = await begun(service)
        service.vehicle.put(mission_seq=2)
        await service.until(lambda: service.run.item_id == "clinic", "it flies what it flew")
        service.vehicle.upload_gate.set()
        await change
        assert service.vehicle.sent[-1] == "set_current 1"
        await service.until(lambda: service.run.item_id == "clinic", "it goes on there")
        assert service.run.flown_item_ids == ("takeoff", "corner")


ANSWER = StoredAnswer("key-1", "hash", 202, {}, b"{}")


async def test_the_answer_to_a_change_is_stored_before_it_is_sent() -> None:
    async with run_service() as service:
        await fly(service)
        service.vehicle.upload_gate.clear()
        asked = service.runs.change_mission(
            service.run_id, store(service, clinic_moved), None, "ann", answer=lambda run: ANSWER
        )
        changing = asyncio.create_task(asked)
        await service.until(lambda: service.vehicle.waits_at_gate, "it must be about to be sent")
        assert service.events.answers == [ANSWER]
        service.vehicle.upload_gate.set()
        await changing
        assert service.events.answers == [ANSWER]


async def test_the_answer_to_a_change_that_could_not_be_stored_is_not_stored_later() -> None:
    async with run_service() as service:
        await fly(service)
        service.events.refuse = lambda event: StorageError("disk full") if data_of(event).get("changing") else None
        asked = service.runs.change_mission(
            service.run_id, store(service, clinic_moved), None, "ann", answer=lambda run: ANSWER
        )
        with pytest.raises(StorageError):
            await asked
        service.events.refuse = lambda event: None
        await service.runs.pause(service.run_id)
        assert service.events.answers == []
