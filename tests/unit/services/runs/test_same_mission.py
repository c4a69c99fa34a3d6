"""A change to the very mission that is on board: that the vehicle names it says nothing of what was sent."""

from __future__ import annotations

import asyncio

import pytest

from app.domain.errors import LinkTimeoutError
from app.services.runs.pending_change import SETTLED_S
from tests.unit.services.runs.desk import Desk, desk, restarted
from tests.unit.services.runs.test_change import Document, fly, item, store


def a_looser_drop(document: Document) -> None:
    """Another plan of the same mission: Waydrop alone reads this."""
    item(document, "drop")["max_offset_m"] = 4.5


async def changed_once(at: Desk) -> None:
    """On the way to the corner, with what is left from there on board."""
    await fly(at)
    await at.runs.change_mission(at.run_id, "plan-1", None, "ann")


async def past_the_corner(at: Desk) -> None:
    await changed_once(at)
    at.vehicle.put(mission_seq=1)
    await at.until(lambda: at.run.item_id == "clinic", "it must fly on")


async def test_a_plan_whose_rest_is_the_mission_that_is_flown_is_taken_with_nothing_sent() -> None:
    async with desk() as at:
        await changed_once(at)
        on_board, sent = at.vehicle.on_board, list(at.vehicle.sent)
        run = await at.runs.change_mission(at.run_id, store(at, a_looser_drop), None, "bob")
        assert (run.plan_id, run.changes, run.changing) == ("plan-2", 2, None)
        assert (at.vehicle.on_board is on_board, at.vehicle.sent) == (True, sent)
        looks = at.vehicle.looks
        await at.until(lambda: at.vehicle.looks > looks + 5, "it must be looked at")
        assert (at.run.item_id, at.run.flown_item_ids) == ("corner", ("takeoff",)), "it goes on where it was"


async def test_to_go_back_to_its_beginning_it_is_sent_again_and_has_not_arrived_before() -> None:
    async with desk() as at:
        await past_the_corner(at)
        at.vehicle.upload_gate.clear()
        change = asyncio.create_task(at.runs.change_mission(at.run_id, "plan-1", "corner", "ann"))
        await at.until(lambda: at.run.changing is not None, "the change must begin")
        looks = at.vehicle.looks
        await at.until(lambda: at.vehicle.looks > looks + 20, "it must be looked at")
        assert (at.run.changes, at.run.item_id) == (1, "clinic"), "the vehicle names it, and flies on"
        at.vehicle.upload_gate.set()
        run = await asyncio.wait_for(change, 10.0)
        assert (run.changes, run.changing) == (2, None)
        await at.until(lambda: at.run.item_id == "corner", "it must fly back")


async def test_a_transfer_of_it_that_nobody_confirmed_counts_for_nothing() -> None:
    async with desk() as at:
        await past_the_corner(at)
        at.vehicle.upload_error = LinkTimeoutError("the link is lost")
        with pytest.raises(LinkTimeoutError):
            await at.runs.change_mission(at.run_id, "plan-1", "corner", "ann")
        pending = at.runs._flights[at.run_id]._watch.change
        assert pending is not None
        assert pending.ended_s is not None
        state = at.vehicle.state()
        assert not pending.has_arrived(state)
        assert pending.is_missing(state, 0.0, pending.ended_s + SETTLED_S + 0.1)
        assert at.run.changes == 1


async def test_after_a_restart_it_is_flown_on_as_before() -> None:
    async with desk() as at:
        await past_the_corner(at)
        at.vehicle.upload_error = LinkTimeoutError("killed meanwhile")
        with pytest.raises(LinkTimeoutError):
            await at.runs.change_mission(at.run_id, "plan-1", "corner", "ann")
        await restarted(at)
        await at.until(lambda: at.run.changing is None, "it is known what is flown")
        assert (at.run.changes, at.run.flown_item_ids) == (1, ("takeoff", "corner"))
