"""A wing whose firmware follows no path point: its tasks are flown by commands in Hold, with the same queue."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest
from shapely import Polygon

from app.domain.airspace.geofence import FenceArea
from app.domain.errors import OffboardNotReadyError, SetpointRefusedError, TaskRefusedError
from app.domain.mission import MavCmd
from app.domain.offboard.state import OffboardState
from app.domain.offboard.tasks.commanded import CIRCLE_HERE
from app.domain.reasons import describe
from app.domain.vehicle.commands import MavResult
from app.domain.vehicle.state import FlightMode
from tests.support.commanded_tasks import CIRCLE, FAR, client_sends, flying, gone_on, ordered, plane
from tests.support.controlled_vehicle import controlled_vehicle, paused_run
from tests.support.queued_tasks import changes, put_at, queue, report


async def test_it_stays_in_hold_is_told_the_place_and_says_how_it_is_flown() -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR, absolute_altitude_m=560.0)
        view = wing.control.view()
        assert (wing.control.state, wing.vehicle.truth.mode) == (OffboardState.ACTIVE, FlightMode.HOLD)
        assert (view.control_method, wing.tasks.view().control_method, view.sent, view.rate) == (
            "commands",
            "commands",
            None,
            None,
        )
        assert wing.sent == [], "no setpoint leaves"
        assert view.command is not None
        assert (view.command.command, view.command.result, view.command.altitude_m) == (
            "DO_REPOSITION",
            MavResult.ACCEPTED,
            560.0,
        )
        assert view.command.latitude_deg == pytest.approx(47.401335, abs=1e-5)
        assert report(wing).state == "flying"
        await gone_on(wing, 1.5)
        assert len(wing.vehicle.orders) == 1, "what holds is not said again"


async def test_a_lost_stream_blocks_no_entry_for_there_is_none() -> None:
    async with plane() as wing:
        entries = await wing.enter()
        assert [entry.parameter for entry in entries if entry.blocks] == []
        assert next(entry.value for entry in entries if entry.parameter == "NAV_LOITER_RAD") == 80.0
        assert (await wing.control.preflight(sticks_held=False)).control_method == "commands"


async def test_circle_pause_resume_insert_and_next_are_orders() -> None:
    async with plane() as wing:
        await flying(wing, "circle", **CIRCLE)
        assert (wing.vehicle.orders[-1].command, wing.vehicle.orders[-1].params[0]) == (MavCmd.DO_ORBIT, -60.0)
        wing.tasks.pause(wing.lease)
        paused = await ordered(wing, 2)
        assert paused.command is MavCmd.DO_REPOSITION
        assert paused.place == (pytest.approx(473978768, abs=50), pytest.approx(85455940, abs=50)), "1 s ahead of here"
        await gone_on(wing, 1.5)
        assert len(wing.vehicle.orders) == 2, "the place is chosen once, though it flies on"
        wing.tasks.resume(wing.lease)
        assert (await ordered(wing, 3)).command is MavCmd.DO_ORBIT
        queue(wing, "goto", "prepend", **FAR)
        assert (await ordered(wing, 4)).command is MavCmd.DO_REPOSITION
        wing.tasks.skip(wing.lease)
        assert (await ordered(wing, 5)).command is MavCmd.DO_ORBIT
        assert report(wing).task_list == [2]


async def test_tasks_end_by_duration_and_by_arrival_and_control_goes_back_to_the_run() -> None:
    async with plane(run=paused_run()) as wing:
        queue(wing, "circle", **CIRCLE, duration_s=3.0)
        await flying(wing, "goto", **FAR)
        await gone_on(wing, 3.3)
        wing.control.require(wing.lease)
        assert (await ordered(wing, 2)).command is MavCmd.DO_REPOSITION
        put_at(wing, 320.0, 0.0)
        await wing.until(lambda: wing.control.lease is None, "the goto ends on its circle")
        assert (wing.runs.asked[-1], wing.vehicle.truth.mode) == ("resume", FlightMode.MISSION)
        ended = [change for change in await changes(wing) if change[0] != "inserted"]
        assert ended == [("time_over", "t1"), ("reached", "t2")]


async def test_without_a_run_the_last_task_ends_in_a_circle_here() -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        put_at(wing, 320.0, 0.0)
        await wing.until(lambda: wing.control.lease is None, "the goto ends")
        assert wing.vehicle.orders[-1] == CIRCLE_HERE


async def test_a_path_is_a_carrot_that_goes_on_with_the_wing_and_turns_at_the_corner() -> None:
    corners = [{"east_m": 0.0, "north_m": north} for north in (0.0, 300.0)] + [{"east_m": 300.0, "north_m": 300.0}]
    async with plane() as wing:
        await flying(wing, "path", points=corners)
        put_at(wing, 100.0, 0.0)
        north = await ordered(wing, 2)
        put_at(wing, 280.0, 0.0)
        east = await ordered(wing, 3)
        assert north.place is not None
        assert east.place is not None
        assert (north.place[1], east.place[1] > 85455940 + 20000) == (pytest.approx(85455940, abs=20), True)
        put_at(wing, 300.0, 280.0, velocity_north_m_s=0.0, velocity_east_m_s=15.0)
        await wing.until(lambda: wing.control.lease is None, "it ends at its end")


async def test_one_order_at_a_time_and_the_newest_is_next() -> None:
    async with plane() as wing:
        wing.vehicle.order_gate.clear()
        queue(wing, "circle", **CIRCLE)
        await wing.enter()
        await wing.until(lambda: len(wing.vehicle.orders) == 1, "the first leaves")
        for radius_m in (-70.0, -80.0):
            queue(wing, "circle", "replace_current", radius_m=radius_m)
            await gone_on(wing, 0.9)
        assert len(wing.vehicle.orders) == 1, "its ack is awaited"
        wing.vehicle.order_gate.set()
        assert (await ordered(wing, 2)).params[0] == -80.0, "what was wanted in between is not worth a command"


async def test_setpoints_are_flown_if_they_were_asked_for_and_then_no_task_is() -> None:
    async with plane() as wing:
        wing.vehicle.parameters["COM_OBL_RC_ACT"] = 5
        await wing.enter()
        with pytest.raises(SetpointRefusedError, match="by commands") as refused:
            wing.put("attitude")
        assert refused.value.refusal == "setpoint.flown_by_commands"
        await wing.control.leave(wing.lease, "hold")
        wing.take()
        saying = asyncio.create_task(client_sends(wing, "attitude"))
        await wing.enter(control_method="setpoints")
        assert (wing.vehicle.truth.mode, wing.control.view().control_method) == (FlightMode.OFFBOARD, "setpoints")
        with pytest.raises(TaskRefusedError) as no_task:
            queue(wing, "circle", **CIRCLE)
        assert no_task.value.refusal == "task.entered_by_setpoints"
        saying.cancel()


async def test_who_follows_setpoints_is_not_entered_by_commands() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        with pytest.raises(OffboardNotReadyError, match="flown by setpoints"):
            await quad.enter(control_method="commands")


async def test_an_order_that_leads_out_of_the_fence_is_not_sent() -> None:
    async with plane() as wing:
        await wing.enter()
        queue(wing, "goto", **FAR)
        assert wing.control.context is not None
        small = FenceArea(Polygon([(-200, -200), (200, -200), (200, 200), (-200, 200)]), None)
        wing.control.set_context(replace(wing.control.context, fence=small))
        await wing.until(lambda: report(wing).state == "paused", "it stops")
        assert "fence" in describe(report(wing).reason)
        circled = await ordered(wing, 1)
        assert circled.place == (pytest.approx(473978768, abs=50), pytest.approx(85455940, abs=50)), "within the fence"
