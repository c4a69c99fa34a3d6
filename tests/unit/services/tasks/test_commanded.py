"""A wing whose firmware follows no path point: its tasks are flown by commands in Hold, with the same queue."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from dataclasses import replace
from typing import Any

import pytest
from shapely import Polygon

from app.domain.commands import CommandRequest, MavResult
from app.domain.errors import LinkTimeoutError, OffboardNotReadyError, SetpointRefusedError, TaskRefusedError
from app.domain.fence_area import FenceArea
from app.domain.mission import MavCmd
from app.domain.tasks.order_request import CIRCLE_HERE
from app.domain.vehicle import FirmwareVersion, FlightMode, VehicleType
from app.services.offboard_view import OffboardState
from tests.unit.services.offboard.cockpit import SETTINGS, Cockpit, cockpit, paused_run
from tests.unit.services.tasks.queued import changes, put_at, queue, report

OLD = FirmwareVersion(1, 14, 3)
FAR: dict[str, Any] = {"point": {"east_m": 0.0, "north_m": 400.0}}
CIRCLE: dict[str, Any] = {"radius_m": -60.0}


@contextlib.asynccontextmanager
async def plane(vehicle_type: VehicleType = VehicleType.FIXED_WING, **more: Any) -> AsyncIterator[Cockpit]:
    """In the air, flying north."""
    async with cockpit(vehicle_type, **more) as found:
        found.vehicle.identity = replace(found.vehicle.identity, firmware=OLD)
        found.vehicle.parameters = {"COM_OBL_RC_ACT": 0, "NAV_LOITER_RAD": 80.0}
        put_at(found, 0.0, 0.0, velocity_north_m_s=15.0)
        found.take()
        yield found


async def flying(plane: Cockpit, kind: str, **changed: Any) -> str:
    """Queue, enter, and see the first order accepted."""
    made = queue(plane, kind, **changed)
    await plane.enter()
    await ordered(plane, 1)
    return made


async def ordered(plane: Cockpit, count: int) -> CommandRequest:
    """So many orders were sent; the last of them, answered."""

    def answered() -> bool:
        plane.clock.time_s += 0.01
        order = plane.control.view().order
        return len(plane.vehicle.orders) >= count and (order is None or order.result != "sent")

    await plane.until(answered, f"{count} orders must be sent, not {len(plane.vehicle.orders)}")
    return plane.vehicle.orders[-1]


async def say(plane: Cockpit, form: str) -> None:
    """As a client does, again and again."""
    while True:
        plane.put(form)
        await asyncio.sleep(0.01)


async def gone_on(plane: Cockpit, seconds: float) -> None:
    """Time passes, and the client renews nothing; ticks come."""
    for _ in range(round(seconds / 0.3)):
        plane.clock.time_s += 0.3
        looks = plane.vehicle.looks
        await plane.until(
            lambda looks=looks: plane.vehicle.looks > looks + 2 or plane.control.lease is None,  # type: ignore[misc]
            "ticks come",
        )


async def test_it_stays_in_hold_is_told_the_place_and_says_how_it_is_flown() -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR, absolute_altitude_m=560.0)
        view = wing.control.view()
        assert (wing.control.state, wing.vehicle.truth.mode) == (OffboardState.ACTIVE, FlightMode.HOLD)
        assert (view.flown_by, wing.desk.view().flown_by, view.sent, view.cadence) == (
            "commands",
            "commands",
            None,
            None,
        )
        assert wing.sent == [], "no setpoint leaves"
        assert view.order is not None
        assert (view.order.command, view.order.result, view.order.altitude_m) == ("DO_REPOSITION", "ACCEPTED", 560.0)
        assert view.order.latitude_deg == pytest.approx(47.401335, abs=1e-5)
        assert report(wing).state == "flying"
        await gone_on(wing, 1.5)
        assert len(wing.vehicle.orders) == 1, "what holds is not said again"


async def test_a_lost_stream_blocks_no_entry_for_there_is_none() -> None:
    async with plane() as wing:
        entries = await wing.enter()
        assert [entry.parameter for entry in entries if entry.blocks] == []
        assert next(entry.value for entry in entries if entry.parameter == "NAV_LOITER_RAD") == 80.0
        assert (await wing.passage.look_ahead(sticks_held=False)).flown_by == "commands"


async def test_circle_pause_resume_insert_and_next_are_orders() -> None:
    async with plane() as wing:
        await flying(wing, "circle", **CIRCLE)
        assert (wing.vehicle.orders[-1].command, wing.vehicle.orders[-1].params[0]) == (MavCmd.DO_ORBIT, -60.0)
        wing.desk.pause(wing.lease)
        paused = await ordered(wing, 2)
        assert paused.command is MavCmd.DO_REPOSITION
        assert paused.place == (pytest.approx(473978768, abs=50), pytest.approx(85455940, abs=50)), "1 s ahead of here"
        await gone_on(wing, 1.5)
        assert len(wing.vehicle.orders) == 2, "the place is chosen once, though it flies on"
        wing.desk.resume(wing.lease)
        assert (await ordered(wing, 3)).command is MavCmd.DO_ORBIT
        queue(wing, "goto", "prepend", **FAR)
        assert (await ordered(wing, 4)).command is MavCmd.DO_REPOSITION
        wing.desk.skip(wing.lease)
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


@pytest.mark.parametrize("how", ["silent", "release", "service stops"])
async def test_when_its_client_is_gone_it_circles_where_it_is_and_the_queue_is_dropped(how: str) -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        queue(wing, "circle", **CIRCLE)
        if how == "silent":
            await gone_on(wing, SETTINGS.lease_s + 0.6)
        elif how == "release":
            wing.control.release(wing.lease, "the client's socket closed")
        else:
            await wing.control.close()
        await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "it circles where it is")
        assert (wing.control.lease, report(wing).task_list) == (None, [0])
        assert (await changes(wing))[-1][0] == "dropped"


@pytest.mark.parametrize("how", ["gap", "mode"])
async def test_where_somebody_else_may_have_acted_nothing_is_commanded(how: str) -> None:
    async with plane() as wing:
        await flying(wing, "circle", **CIRCLE)
        if how == "gap":
            wing.control.end("revoked", "the service stood still for 2.0 s")
        else:
            wing.vehicle.put(mode=FlightMode.RETURN)
        assert wing.control.lease is None
        await wing.quiet()
        assert len(wing.vehicle.orders) == 1


async def test_without_a_position_nothing_is_guided_and_after_a_second_it_circles_where_it_is() -> None:
    async with plane() as wing:
        await flying(wing, "segment", start={"east_m": 0, "north_m": 0}, end={"east_m": 0, "north_m": 400})
        wing.vehicle.put(latitude_deg=None)
        await gone_on(wing, 1.5)
        await wing.until(lambda: wing.control.lease is None, "the lease ends")
        await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "it circles where it is")
        assert "no fresh position" in report(wing).reason


async def test_what_the_vehicle_refuses_stops_the_queue_and_resume_asks_again() -> None:
    async with plane() as wing:
        wing.vehicle.order_answers = [MavResult.DENIED]
        await flying(wing, "circle", **CIRCLE)
        await wing.until(lambda: report(wing).state == "paused", "it must stop")
        assert report(wing).reason == "DO_ORBIT was answered DENIED"
        assert (await ordered(wing, 2)).command is MavCmd.DO_REPOSITION
        wing.desk.resume(wing.lease)
        assert (await ordered(wing, 3)).command is MavCmd.DO_ORBIT
        assert report(wing).state == "flying"


async def test_an_order_without_an_ack_is_sent_again_and_three_end_the_lease() -> None:
    async with plane() as wing:
        wing.vehicle.order_answers = [LinkTimeoutError("no final ack")]
        await flying(wing, "circle", **CIRCLE)
        await ordered(wing, 2)
        order = wing.control.view().order
        assert order is not None
        assert (order.result, len(wing.vehicle.orders)) == ("ACCEPTED", 2)
        wing.vehicle.order_answers = [LinkTimeoutError("no final ack") for _ in range(3)]
        wing.desk.pause(wing.lease)
        await ordered(wing, 5)
        await gone_on(wing, 0.6)
        await wing.until(lambda: wing.control.lease is None, "the lease ends")
        assert "not answered" in report(wing).reason


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


async def test_what_is_under_way_when_the_lease_ends_is_never_sent_after_the_last_word() -> None:
    async with plane() as wing:
        wing.vehicle.order_gate.clear()
        queue(wing, "circle", **CIRCLE)
        await wing.enter()
        await wing.until(lambda: len(wing.vehicle.orders) == 1, "the first leaves")
        wing.control.release(wing.lease, "released by its holder")
        wing.vehicle.order_gate.set()
        await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "it circles where it is")
        await wing.quiet()
        assert len(wing.vehicle.orders) == 2


async def test_an_override_stops_what_was_flown() -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        wing.take("admin", override=True)
        await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "it circles where it is")
        assert (wing.control.state, report(wing).task_list) == (OffboardState.ACTIVE, [0])
        queue(wing, "circle", **CIRCLE)
        assert (await ordered(wing, 3)).command is MavCmd.DO_ORBIT


@pytest.mark.parametrize(("to", "mode"), [("hold", FlightMode.HOLD), ("return", FlightMode.RETURN)])
async def test_leaving_to_hold_circles_here_and_any_other_way_is_its_mode(to: Any, mode: FlightMode) -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        await wing.passage.leave(wing.lease, to)
        assert (wing.control.lease, wing.vehicle.truth.mode) == (None, mode)
        assert (wing.vehicle.orders[-1] == CIRCLE_HERE) is (to == "hold")


async def test_setpoints_are_flown_if_they_were_asked_for_and_then_no_task_is() -> None:
    async with plane() as wing:
        wing.vehicle.parameters["COM_OBL_RC_ACT"] = 5
        await wing.enter()
        with pytest.raises(SetpointRefusedError, match="by commands") as refused:
            wing.put("attitude")
        assert refused.value.refusal == "setpoint.flown_by_commands"
        await wing.passage.leave(wing.lease, "hold")
        wing.take()
        saying = asyncio.create_task(say(wing, "attitude"))
        await wing.enter(by="setpoints")
        assert (wing.vehicle.truth.mode, wing.control.view().flown_by) == (FlightMode.OFFBOARD, "setpoints")
        with pytest.raises(TaskRefusedError) as no_task:
            queue(wing, "circle", **CIRCLE)
        assert no_task.value.refusal == "tasks.entered_by_setpoints"
        saying.cancel()


async def test_who_follows_setpoints_is_not_entered_by_commands() -> None:
    async with cockpit() as quad:
        quad.take()
        with pytest.raises(OffboardNotReadyError, match="flown by setpoints"):
            await quad.enter(by="commands")


async def test_a_vtol_that_begins_to_hover_is_not_flown_on_as_a_wing() -> None:
    async with plane(VehicleType.VTOL, vtol_state="fixed_wing") as wing:
        await flying(wing, "circle", **CIRCLE)
        wing.vehicle.put(vtol_state="multicopter")
        await wing.until(lambda: wing.control.lease is None, "the lease ends")
        assert "hovers" in report(wing).reason
        await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "it stays where it is")


async def test_an_order_that_leads_out_of_the_fence_is_not_sent() -> None:
    async with plane() as wing:
        await wing.enter()
        queue(wing, "goto", **FAR)
        assert wing.control.surroundings is not None
        small = FenceArea(Polygon([(-200, -200), (200, -200), (200, 200), (-200, 200)]), None)
        wing.control.enclose(replace(wing.control.surroundings, fence=small))
        await wing.until(lambda: report(wing).state == "paused", "it stops")
        assert "fence" in report(wing).reason
        circled = await ordered(wing, 1)
        assert circled.place == (pytest.approx(473978768, abs=50), pytest.approx(85455940, abs=50)), "within the fence"
