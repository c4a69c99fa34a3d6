"""Whose queue it is: the lease's. Whatever ends the lease ends the queue, and the guidance renews nothing."""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace
from typing import Any

import pytest
from shapely import Polygon

from app.domain.airspace.geofence import FenceArea
from app.domain.errors import LeaseLostError, LinkTimeoutError
from app.domain.offboard.messages import LocalTarget
from app.domain.offboard.state import OffboardState
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.vehicle.state import FlightMode, VehicleType
from tests.support.controlled_vehicle import SETTINGS, ControlledVehicle, controlled_vehicle, paused_run
from tests.support.queued_tasks import author, changes, flying, put_at, queue, report
from tests.support.reasons import some


async def pass_s(quad: ControlledVehicle, seconds: float) -> None:
    """The clock goes on in steps that the dead-man for setpoints would bear, and ticks come."""
    for _ in range(round(seconds / 0.3)):
        quad.clock.time_s += 0.3
        before = len(quad.sent)
        await quad.until(lambda: len(quad.sent) > before or quad.control.lease is None, "ticks come")  # noqa: B023


async def test_a_queue_is_flown_while_its_client_renews_the_lease_and_no_longer() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "circle")
        for _ in range(3):
            await pass_s(quad, 6.0)
            quad.control.require(quad.lease)
        assert report(quad).state == "flying", "the client may be silent for longer than a setpoint lives"
        await pass_s(quad, SETTINGS.lease_s + 0.6)
        assert quad.control.lease is None, "the guidance must not renew the lease for a client that has gone"
        await quad.until(lambda: quad.vehicle.truth.mode is FlightMode.HOLD, "Hold is commanded")
        assert await quad.quiet() == 0
        assert (report(quad).state, report(quad).task_list) == ("idle", [0])
        assert "not renewed" in describe(report(quad).reason)
        assert (await changes(quad))[-1] == ("dropped", "t1")


@pytest.mark.parametrize("paused", [False, True])
async def test_a_lost_position_is_told_as_what_it_is_and_not_as_the_silence_of_the_client(paused: bool) -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "circle")
        if paused:
            quad.tasks.pause(quad.lease)
        quad.vehicle.put(latitude_deg=None)
        for _ in range(40):
            if quad.control.lease is None:
                break
            quad.control.require(quad.lease)
            await pass_s(quad, 0.3)
        assert quad.control.reason is not None
        assert quad.control.reason.code is ReasonCode.OFFBOARD_ALL_REJECTED
        assert "no recent position" in describe(quad.control.reason)


@pytest.mark.parametrize("how", ["release", "mode", "gap", "override"])
async def test_every_end_of_the_lease_drops_the_queue(how: str) -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "circle")
        queue(quad, "goto")
        if how == "release":
            quad.control.release(quad.lease, Reason.of(ReasonCode.OFFBOARD_RELEASED))
        elif how == "mode":
            quad.vehicle.put(mode=FlightMode.POSITION)
        elif how == "gap":
            quad.control.end("revoked", some("the service stood still for 2.0 s"))
        else:
            quad.take("ben", override=True)
        assert report(quad).task_list == [0]
        assert (report(quad).reason is None) == (how == "override"), (
            "what ended a lease explains nothing of the next one"
        )
        assert (await changes(quad))[-1][0] == "dropped"
        quad.clock.time_s += 0.3
        await quad.quiet()
        assert author(quad) != "task"


async def test_a_new_lease_begins_with_an_empty_queue_and_the_old_one_is_worth_nothing() -> None:
    async with controlled_vehicle() as quad:
        old = quad.take()
        queue(quad, "goto")
        quad.control.release(quad.lease, Reason.of(ReasonCode.OFFBOARD_RELEASED))
        quad.take("ben")
        assert report(quad).task_list == [0]
        with pytest.raises(LeaseLostError):
            quad.tasks.clear(old)
        assert queue(quad, "circle") == "t2", "ids are never used twice"


async def test_a_setpoint_of_the_client_takes_over_and_its_own_dead_man_counts() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "circle", duration_s=60.0)
        quad.put(north_m_s=1.0, east_m_s=0.0, down_m_s=0.0)
        await quad.ticks(2)
        assert (report(quad).state, author(quad)) == ("manual", "client")
        quad.clock.time_s += 0.6
        await quad.until(lambda: author(quad) == "dead_man", "a client in control must keep talking")
        quad.tasks.resume(quad.lease)
        await quad.until(lambda: author(quad) == "task", "resume gives it back to the guidance")
        quad.put(north_m_s=1.0, east_m_s=0.0, down_m_s=0.0)
        await quad.silent_for(1.5)
        await quad.until(lambda: quad.control.lease is None, "a silent pilot is Hold, with tasks in the queue too")


async def test_without_a_position_the_guidance_falls_silent_and_the_dead_man_acts() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "circle")
        quad.vehicle.put(latitude_deg=None)
        quad.clock.time_s += 0.6
        await quad.until(lambda: author(quad) == "dead_man", "zero velocity")
        await quad.silent_for(1.0)
        await quad.until(lambda: quad.vehicle.truth.mode is FlightMode.HOLD, "then Hold")
        assert report(quad).task_list == [0]


async def test_a_task_that_leads_out_of_the_fence_read_at_the_entry_stands_and_says_why() -> None:
    """Queued before the entry it was not measured against that fence."""
    async with controlled_vehicle() as quad:
        await flying(quad, "goto", point={"east_m": 0.0, "north_m": 80.0})
        assert quad.control.context is not None
        small = FenceArea(Polygon([(-5, -5), (5, -5), (5, 5), (-5, 5)]), None)
        quad.control.set_context(replace(quad.control.context, fence=small))
        await quad.ticks(2)
        assert report(quad).state == "flying", "there is room yet"
        put_at(quad, 4.0, 0.0)
        await quad.until(lambda: report(quad).state == "paused", "it must stand")
        assert "fence" in describe(report(quad).reason)
        assert (await changes(quad))[-1] == ("blocked", "t1")
        await quad.ticks(2)
        assert author(quad) == "task", "it stands where it is, within the fence"


@pytest.mark.parametrize("how", ["at once", "later"])
async def test_paused_just_before_the_fence_it_stands_where_it_is(how: str) -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "goto", point={"east_m": 0.0, "north_m": 80.0})
        assert quad.control.context is not None
        small = FenceArea(Polygon([(-5, -5), (5, -5), (5, 5), (-5, 5)]), None)
        quad.control.set_context(replace(quad.control.context, fence=small))
        put_at(quad, 0.0 if how == "later" else 4.0, 0.0, velocity_north_m_s=3.0)
        quad.tasks.pause(quad.lease)
        await quad.ticks(3)
        if how == "later":  # what it was to stand at is left behind the fence
            small = FenceArea(Polygon([(-5, -5), (5, -5), (5, 2), (-5, 2)]), None)
            quad.control.set_context(replace(quad.control.context, fence=small))
            put_at(quad, 1.5, 0.0, velocity_north_m_s=0.0)
        await pass_s(quad, 3.0)
        assert (report(quad).state, author(quad)) == ("paused", "task"), "the guidance must not fall silent"
        newest = quad.sent[-1]
        assert isinstance(newest, LocalTarget)
        assert newest.position[0] == pytest.approx(1.5 if how == "later" else 4.0, abs=0.1)


async def test_near_the_fence_it_is_flown_slower_and_not_stopped() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "circle", radius_m=25.0)
        assert quad.control.context is not None
        large = FenceArea(Polygon([(-90, -90), (36, -90), (36, 90), (-90, 90)]), None)
        quad.control.set_context(replace(quad.control.context, fence=large))
        put_at(quad, 37.0, 27.0)  # north-east on the circle: the tangent leads out of the fence, the circle does not
        await quad.ticks(4)
        newest = quad.sent[-1]
        assert report(quad).state == "flying"
        assert isinstance(newest, LocalTarget)
        assert 0.1 < math.hypot(newest.velocity[0], newest.velocity[1]) < 5.0


async def test_a_wing_that_is_paused_circles_and_does_not_fly_on() -> None:
    async with controlled_vehicle(VehicleType.FIXED_WING) as plane:
        await flying(plane, "segment", speed_m_s=15.0)
        plane.tasks.pause(plane.lease)
        await plane.ticks(3)
        assert (plane.control.state, author(plane)) == (OffboardState.ACTIVE, "task")
        assert plane.sent[-1].type_mask == 3520


class Stuck:
    """A call that waits until it is let go, and is then what it was."""

    def __init__(self, original: Any = None) -> None:
        self.reached, self.gate = asyncio.Event(), asyncio.Event()
        self._original = original

    async def __call__(self, *args: Any, **more: Any) -> Any:
        self.reached.set()
        await self.gate.wait()
        return await self._original(*args, **more)


async def ending(quad: ControlledVehicle, work: str) -> asyncio.Event:
    """The only task ends, and the way back to the plan waits in this call of the runs until the event is set."""
    await flying(quad, "goto")
    stuck = Stuck(getattr(quad.runs, work))
    setattr(quad.runs, work, stuck)
    put_at(quad, 20.0, 10.0)
    await asyncio.wait_for(stuck.reached.wait(), 10.0)
    return stuck.gate


@pytest.mark.parametrize("work", ["get", "resume"])
async def test_a_lease_that_ends_on_the_way_back_to_the_plan_is_hold_and_stays_hold(work: str) -> None:
    async with controlled_vehicle(run=paused_run()) as quad:
        gate = await ending(quad, work)
        quad.control.give_up("released", Reason.of(ReasonCode.OFFBOARD_SOCKET_CLOSED))
        await quad.until(lambda: quad.vehicle.truth.mode is FlightMode.HOLD, "Hold is commanded")
        gate.set()
        await quad.quiet()
        assert "resume" not in quad.runs.asked, "nobody is there who lets it fly its mission"
        assert quad.vehicle.truth.mode is FlightMode.HOLD


@pytest.mark.parametrize("work", ["get", "resume"])
async def test_an_override_on_the_way_back_to_the_plan_has_the_vehicle(work: str) -> None:
    async with controlled_vehicle(run=paused_run()) as quad:
        gate = await ending(quad, work)
        quad.take("admin", override=True)
        gate.set()
        await quad.until_state(OffboardState.ACTIVE)
        quad.put()
        await quad.ticks(2)
        assert "resume" not in quad.runs.asked
        assert quad.control.lease is not None
        assert (quad.control.lease.holder, quad.vehicle.truth.mode) == ("admin", FlightMode.OFFBOARD)


async def test_a_queue_that_ends_by_itself_renews_nothing() -> None:
    async with controlled_vehicle(run=paused_run()) as quad:
        await flying(quad, "goto")
        quad.runs.resume = stuck = Stuck()  # type: ignore[method-assign]
        assert quad.control.lease is not None
        expires_s = quad.control.lease.expires_s
        quad.clock.time_s += 0.3
        put_at(quad, 20.0, 10.0)
        await asyncio.wait_for(stuck.reached.wait(), 10.0)
        assert quad.control.lease.expires_s == expires_s


async def test_the_pilot_leaves_while_the_queue_ends_and_the_pilot_counts() -> None:
    async with controlled_vehicle(run=paused_run()) as quad:
        gate = await ending(quad, "resume")
        await quad.control.leave(quad.lease, "hold")
        gate.set()
        await quad.quiet()
        assert (quad.runs.asked[-1], quad.vehicle.truth.mode) == ("pause", FlightMode.HOLD)


async def test_leaving_that_fails_does_not_fly_the_tasks_on_unasked() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "circle")
        hold = quad.vehicle.hold

        async def silent() -> None:
            raise LinkTimeoutError("no ack")

        quad.vehicle.hold = silent  # type: ignore[method-assign]
        with pytest.raises(LinkTimeoutError):
            await quad.control.leave(quad.lease, "hold")
        quad.vehicle.hold = hold  # type: ignore[method-assign]
        before = len(quad.sent)
        await quad.ticks(3)
        assert (report(quad).state, report(quad).reason) == ("paused", Reason.of(ReasonCode.TASK_LEAVING))
        newest = quad.sent[before + 2]
        assert isinstance(newest, LocalTarget)
        assert newest.type_mask & 0x7 == 0, "it stands at a place"
        quad.tasks.resume(quad.lease)
        await quad.until(lambda: report(quad).state == "flying", "the pilot says so")
