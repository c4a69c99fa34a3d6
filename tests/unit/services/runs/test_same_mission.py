"""A change to the very mission that is on board: that the vehicle names it says nothing of what was sent."""

from __future__ import annotations

import asyncio

import pytest

from app.domain.errors import ChangeUnderWayError, LinkTimeoutError, StorageError
from app.domain.flight.inputs import SETTLED_S
from tests.support.changed_flight import Document, fly, item, store
from tests.support.run_service import RunService, restarted, run_service


def a_looser_drop(document: Document) -> None:
    """Another plan of the same mission: Waydrop alone reads this."""
    item(document, "drop")["max_offset_m"] = 4.5


async def changed_once(service: RunService) -> None:
    """On the way to the corner, with what is left from there on board."""
    await fly(service)
    await service.runs.change_mission(service.run_id, "plan-1", None, "ann")


async def past_the_corner(service: RunService) -> None:
    await changed_once(service)
    service.vehicle.put(mission_seq=1)
    await service.until(lambda: service.run.item_id == "clinic", "it must fly on")


async def test_a_plan_whose_rest_is_the_mission_that_is_flown_is_taken_with_nothing_sent() -> None:
    async with run_service() as service:
        await changed_once(service)
        on_board, sent = service.vehicle.on_board, list(service.vehicle.sent)
        run = await service.runs.change_mission(service.run_id, store(service, a_looser_drop), None, "bob")
        assert (run.plan_id, run.changes, run.changing) == ("plan-2", 2, None)
        assert (service.vehicle.on_board is on_board, service.vehicle.sent) == (True, sent)
        looks = service.vehicle.looks
        await service.until(lambda: service.vehicle.looks > looks + 5, "it must be looked at")
        assert (service.run.item_id, service.run.flown_item_ids) == ("corner", ("takeoff",)), "it goes on where it was"


async def test_to_go_back_to_its_beginning_it_is_sent_again_and_has_not_arrived_before() -> None:
    async with run_service() as service:
        await past_the_corner(service)
        service.vehicle.upload_gate.clear()
        change = asyncio.create_task(service.runs.change_mission(service.run_id, "plan-1", "corner", "ann"))
        await service.until(lambda: service.run.changing is not None, "the change must begin")
        looks = service.vehicle.looks
        await service.until(lambda: service.vehicle.looks > looks + 20, "it must be looked at")
        assert (service.run.changes, service.run.item_id) == (1, "clinic"), "the vehicle names it, and flies on"
        service.vehicle.upload_gate.set()
        run = await asyncio.wait_for(change, 10.0)
        assert (run.changes, run.changing) == (2, None)
        await service.until(lambda: service.run.item_id == "corner", "it must fly back")


async def test_a_transfer_of_it_that_nobody_confirmed_counts_for_nothing() -> None:
    async with run_service() as service:
        await past_the_corner(service)
        service.vehicle.upload_error = LinkTimeoutError("the link is lost")
        with pytest.raises(LinkTimeoutError):
            await service.runs.change_mission(service.run_id, "plan-1", "corner", "ann")
        pending = service.flight.flight.change
        assert pending is not None
        assert pending.ended_s is not None
        state = service.vehicle.state()
        assert not pending.has_arrived(state)
        assert pending.is_missing(state, 0.0, pending.ended_s + SETTLED_S + 0.1)
        assert service.run.changes == 1


async def test_after_a_restart_it_is_flown_on_as_before() -> None:
    async with run_service() as service:
        await past_the_corner(service)
        service.vehicle.upload_error = LinkTimeoutError("killed meanwhile")
        with pytest.raises(LinkTimeoutError):
            await service.runs.change_mission(service.run_id, "plan-1", "corner", "ann")
        await restarted(service)
        await service.until(lambda: service.run.changing is None, "it is known what is flown")
        assert (service.run.changes, service.run.flown_item_ids) == (1, ("takeoff", "corner"))


async def test_it_is_not_taken_before_it_is_stored_and_not_at_all_if_it_cannot_be() -> None:
    async with run_service() as service:
        await changed_once(service)
        service.events.refuse = lambda event: StorageError("disk full")
        with pytest.raises(StorageError):
            await service.runs.change_mission(service.run_id, store(service, a_looser_drop), None, "bob")
        assert (service.newest.plan_id, service.newest.changes, service.newest.changing) == ("plan-1", 1, None)
        service.events.refuse = lambda event: None
        service.vehicle.put(mission_seq=1)
        await service.until(lambda: service.run.item_id == "clinic", "it flies on, and is stored again")
        assert (service.run.plan_id, service.run.changes, service.run.changing) == ("plan-1", 1, None)
        assert service.kinds().count("run.mission_changed") == 1
        run = await service.runs.change_mission(service.run_id, "plan-2", "corner", "bob")
        assert (run.plan_id, run.changes) == ("plan-2", 2), "and may be changed as before"


async def test_it_is_not_taken_when_something_else_is_commanded_while_it_is_stored() -> None:
    async with run_service() as service:
        await changed_once(service)
        service.events.pause()
        change = asyncio.create_task(
            service.runs.change_mission(service.run_id, store(service, a_looser_drop), None, "bob")
        )
        await service.until(lambda: service.newest.changing is not None, "the change must begin")
        returns = asyncio.create_task(service.runs.return_to_launch(service.run_id))
        await service.until(lambda: service.newest.commanded == "return", "it is asked")
        service.events.open.set()
        with pytest.raises(ChangeUnderWayError):
            await asyncio.wait_for(change, 10.0)
        await returns
        assert (service.run.plan_id, service.run.changes, service.run.changing) == ("plan-1", 1, None)
