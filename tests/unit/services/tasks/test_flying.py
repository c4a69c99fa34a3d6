"""A queue that is flown: its order, its ends, and what happens when no task is left."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from app.domain.errors import (
    ConflictError,
    LeaseLostError,
    NotFoundError,
    SetpointRefusedError,
    TaskActiveError,
    TaskQueueFullError,
    TaskRefusedError,
)
from app.domain.offboard.limits import OffboardLimits
from app.domain.offboard.messages import LocalTarget
from app.domain.offboard.state import OffboardState
from app.domain.offboard.tasks.forms import LocalPoint, Motion, TaskTerms
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.vehicle.state import FlightMode, GlobalPosition, VehicleType
from tests.support.controlled_vehicle import SETTINGS, controlled_vehicle, paused_run
from tests.support.queued_tasks import author, changes, flying, put_at, queue, report
from tests.support.task_examples import task


async def test_tasks_wait_for_offboard_control_and_then_the_guidance_speaks() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        queue(quad, "circle")
        assert (report(quad).state, report(quad).task_list, quad.sent) == ("waiting", [2], [])
        await quad.enter()
        await quad.ticks(3)
        assert (report(quad).state, author(quad)) == ("flying", "task")
        newest = quad.sent[-1]
        assert isinstance(newest, LocalTarget)
        assert newest.velocity[0] ** 2 + newest.velocity[1] ** 2 > 1.0


async def test_a_wing_enters_with_a_task_and_gets_a_path_point_and_its_tangent() -> None:
    async with controlled_vehicle(VehicleType.FIXED_WING) as plane:
        await flying(plane, "circle", radius_m=80.0)
        assert plane.control.state is OffboardState.ACTIVE
        newest = plane.sent[-1]
        assert isinstance(newest, LocalTarget)
        assert newest.type_mask == 3520


async def test_without_a_lease_nothing_is_queued() -> None:
    async with controlled_vehicle() as quad:
        with pytest.raises(LeaseLostError):
            queue(quad, "goto")
        assert quad.tasks.view().report.task_list == [0]


async def test_tasks_follow_each_other_as_they_end_and_the_rest_is_reported() -> None:
    async with controlled_vehicle(run=paused_run()) as quad:
        quad.take()
        for kind in ("goto", "circle", "segment"):
            queue(quad, kind, duration_s=5.0 if kind == "circle" else -1.0)
        await quad.enter()
        assert (report(quad).task_list, report(quad).remaining_s) == ([1, 2, 3], -1.0)
        put_at(quad, 20.0, 10.0)
        await quad.until(lambda: report(quad).task_list == [2, 3], "a goto ends at its place")
        quad.clock.time_s += 1.0
        quad.control.require(quad.lease)
        await quad.until(lambda: report(quad).remaining_s == 4.0, "a duration is counted while it is flown")
        for _ in range(5):
            quad.clock.time_s += 1.0
            quad.control.require(quad.lease)
            await quad.ticks(2)
        assert report(quad).task_list == [3], "a circle ends by its duration only"
        put_at(quad, 80.0, 10.0)
        await quad.until(lambda: quad.control.lease is None, "the last one ends at its end")
        assert (quad.runs.asked[-1], quad.vehicle.truth.mode) == ("resume", FlightMode.MISSION)
        ended = [change for change in await changes(quad) if change[0] != "inserted"]
        assert ended == [("reached", "t1"), ("time_over", "t2"), ("reached", "t3")]
        assert await quad.quiet() == 0


async def test_a_duration_ends_a_segment_before_its_end_and_a_stay_at_a_place() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "segment", duration_s=2.0)
        queue(quad, "goto", stay=True, duration_s=2.0)
        queue(quad, "circle")
        put_at(quad, 20.0, 10.0)
        for left in ([1, 2], [2]):
            quad.control.require(quad.lease)
            quad.clock.time_s += 2.1
            await quad.until(lambda left=left: report(quad).task_list == left, "the duration is over")  # type: ignore[misc]


async def test_without_a_run_an_empty_queue_is_hold() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "goto")
        put_at(quad, 20.0, 10.0)
        await quad.until(lambda: quad.control.lease is None, "the lease is given back")
        assert quad.vehicle.truth.mode is FlightMode.HOLD
        assert report(quad).state == "idle"


async def test_a_queue_that_waits_stands_until_the_next_task_comes() -> None:
    async with controlled_vehicle(run=paused_run()) as quad:
        await flying(quad, "goto", when_empty="wait")
        put_at(quad, 20.0, 10.0)
        await quad.until(lambda: report(quad).state == "standing", "no task is left")
        before = len(quad.sent)
        await quad.ticks(3)
        assert (report(quad).task_list, quad.runs.asked) == ([0], ["pause"])
        newest = quad.sent[before + 1]
        assert isinstance(newest, LocalTarget)
        assert newest.position[:2] == pytest.approx((20.0, 10.0), abs=0.01)
        queue(quad, "circle")
        await quad.until(lambda: report(quad).state == "flying", "the next is flown")


async def test_leaving_that_fails_stands_and_says_why() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "goto")
        quad.vehicle.hold_gate.clear()

        async def refuse() -> None:
            raise ConflictError("no")

        quad.vehicle.hold = refuse  # type: ignore[method-assign]
        put_at(quad, 20.0, 10.0)
        await quad.until(lambda: report(quad).state == "paused", "it must stand")
        assert "leaving to hold failed" in describe(report(quad).reason)
        assert quad.control.state is OffboardState.ACTIVE


async def test_a_setpoint_as_control_returns_is_refused_and_leaving_to_hold_stops_it() -> None:
    async with controlled_vehicle(run=paused_run()) as quad:
        await flying(quad, "circle")
        disk, resume = asyncio.Event(), quad.runs.resume

        async def resume_late(run_id: str) -> None:
            await disk.wait()
            await resume(run_id)

        quad.runs.resume = resume_late  # type: ignore[method-assign]
        quad.tasks.skip(quad.lease)
        await quad.until_state(OffboardState.LEAVING)
        with pytest.raises(SetpointRefusedError, match="leaving") as refused:
            quad.put()
        assert (refused.value.refusal, report(quad).state) == ("setpoint.leaving", "ending")
        await quad.ticks(2)
        assert author(quad) != "client", "none of what is refused is sent"
        await quad.control.leave(quad.lease, "hold")
        disk.set()
        assert await quad.quiet() == 0
        assert (quad.runs.asked, quad.vehicle.truth.mode) == (["pause", "pause"], FlightMode.HOLD)


async def test_next_clear_pause_and_resume() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "segment", duration_s=100.0)
        queue(quad, "circle", duration_s=50.0)
        quad.clock.time_s += 5.0
        await quad.until(lambda: report(quad).remaining_s == 95.0, "it is flown")
        quad.tasks.pause(quad.lease)
        quad.clock.time_s += 5.0
        before = len(quad.sent)
        await quad.ticks(3)
        assert (report(quad).state, report(quad).remaining_s) == ("paused", 95.0)
        newest = quad.sent[before + 2]
        assert isinstance(newest, LocalTarget)
        assert newest.type_mask & 0x7 == 0, "it stands at a place"
        with pytest.raises(ConflictError):
            quad.tasks.pause(quad.lease)
        quad.tasks.resume(quad.lease)
        quad.tasks.skip(quad.lease)
        assert (report(quad).task_list, report(quad).remaining_s) == ([2], 50.0)
        quad.tasks.clear(quad.lease)
        await quad.until(lambda: quad.vehicle.truth.mode is FlightMode.HOLD, "an empty queue gives control back")
        with pytest.raises(LeaseLostError):
            quad.tasks.skip(quad.lease)


async def test_nothing_is_skipped_or_resumed_that_is_not_there() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        for ask in (quad.tasks.skip, quad.tasks.pause, quad.tasks.resume):
            with pytest.raises(ConflictError):
                ask(quad.lease)


async def test_a_prepended_task_is_flown_first_and_the_other_goes_on_afterwards() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "segment", duration_s=100.0)
        quad.clock.time_s += 5.0
        await quad.ticks(2)
        queue(quad, "goto", "prepend")
        put_at(quad, 20.0, 10.0)
        await quad.until(lambda: report(quad).task_list == [3], "the goto ends")
        assert report(quad).remaining_s == pytest.approx(100.0, abs=0.1), "its time begins anew"


async def test_what_is_moved_to_the_front_is_flown_at_once_and_the_current_task_may_be_removed() -> None:
    async with controlled_vehicle() as quad:
        first = await flying(quad, "circle", duration_s=30.0)
        second, third = queue(quad, "goto"), queue(quad, "segment", when_empty="wait")
        quad.tasks.move(quad.lease, third, first)
        await quad.ticks(2)
        assert (report(quad).current_id, report(quad).task_list) == (third, [3, 2, 1])
        quad.tasks.move(quad.lease, second, first)
        quad.tasks.move(quad.lease, second, first)  # there already: nothing to tell
        quad.tasks.remove(quad.lease, third)
        quad.tasks.remove(quad.lease, first)
        assert (report(quad).current_id, report(quad).task_list) == (second, [1])
        quad.tasks.remove(quad.lease, second)
        assert report(quad).state == "standing", "as when the last one ends"
        told = (await changes(quad))[3:]
        assert told == [
            ("moved", third),
            ("moved", second),
            ("removed", third),
            ("removed", first),
            ("removed", second),
        ]


async def test_a_full_queue_and_a_task_beyond_the_limits_are_refused_and_change_nothing() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        for _ in range(20):
            queue(quad, "goto")
        before = quad.tasks.view()
        with pytest.raises(TaskQueueFullError):
            queue(quad, "goto")
        with pytest.raises(TaskRefusedError, match="from home"):
            queue(quad, "goto", "replace_all", point={"east_m": 5000.0, "north_m": 0.0})
        assert quad.tasks.view() == before


async def test_a_moving_target_is_followed_until_it_is_told_to_stand() -> None:
    async with controlled_vehicle() as quad:
        made = await flying(quad, "goto", motion={"north_m_s": 2.0, "east_m_s": 0.0})
        put_at(quad, 20.0, 10.0)
        await quad.ticks(3)
        assert report(quad).current_id == made, "it does not end where the target is"
        assert isinstance(quad.sent[-1], LocalTarget)
        assert quad.sent[-1].velocity[0] > 0.0
        with pytest.raises(NotFoundError):
            quad.tasks.retarget(quad.lease, "t9", LocalPoint(east_m=0.0, north_m=0.0), None)
        point = LocalPoint(east_m=10.0, north_m=60.0)
        quad.tasks.retarget(quad.lease, made, point, Motion(north_m_s=2.0, east_m_s=0.0))
        quad.tasks.retarget(quad.lease, made, point, None)
        put_at(quad, 60.0, 10.0)
        await quad.until(lambda: quad.control.lease is None, "a target that stands is reached")


async def test_only_a_goto_has_a_target() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        made = queue(quad, "circle")
        with pytest.raises(ConflictError, match="no movable target"):
            quad.tasks.retarget(quad.lease, made, LocalPoint(east_m=0.0, north_m=0.0), None)


async def test_a_task_is_mended_until_it_is_flown_and_keeps_its_place_its_course_and_its_leg() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        first, circle = queue(quad, "path"), queue(quad, "circle", relative_altitude_m=20.0)
        quad.tasks.change(quad.lease, first, TaskTerms(speed_m_s=3.0))
        quad.tasks.change(quad.lease, circle, TaskTerms(duration_s=60.0))
        quad.tasks.change(quad.lease, circle, TaskTerms(duration_s=60.0))
        assert [entry.task.speed_m_s for entry in quad.tasks.view().tasks] == [3.0, None]
        await quad.enter()
        await quad.ticks(2)
        with pytest.raises(TaskActiveError) as refused:
            quad.tasks.change(quad.lease, first, TaskTerms(speed_m_s=2.0))
        assert "replace_current" in refused.value.hint
        with pytest.raises(TaskRefusedError, match="above home"):
            quad.tasks.change(quad.lease, circle, TaskTerms(relative_altitude_m=900.0))
        quad.tasks.change(quad.lease, circle, TaskTerms(radius_m=15.0))
        entries = quad.tasks.view().tasks
        assert [(entry.id, entry.remaining_s) for entry in entries] == [(first, -1.0), (circle, 60.0)]
        quad.tasks.skip(quad.lease)
        await quad.ticks(2)
        current = quad.tasks.view().tasks[0]
        assert (current.task, report(quad).remaining_s) == (
            task("circle", relative_altitude_m=20.0, duration_s=60.0, radius_m=15.0),
            60.0,
        )
        assert current.cross_m is not None
        assert current.cross_m != 0.0
        with pytest.raises(NotFoundError) as over:
            quad.tasks.change(quad.lease, first, TaskTerms(duration_s=5.0))
        assert "has ended" in over.value.hint
        told = [change for change in await changes(quad) if change[0] == "changed"]
        assert told == [("changed", first), ("changed", circle), ("changed", circle)], "and no more"


async def test_a_target_that_moves_is_not_set_back_by_another_duration() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        queue(quad, "circle")
        made = queue(quad, "goto", motion={"north_m_s": 2.0, "east_m_s": 0.0})
        course = quad.control.setpoint_source.queue.entry(made).course  # type: ignore[union-attr]
        quad.clock.time_s += 3.0
        quad.tasks.change(quad.lease, made, TaskTerms(duration_s=60.0))
        assert quad.control.setpoint_source.queue.entry(made).course is course  # type: ignore[union-attr]


async def test_a_new_lease_begins_without_the_reason_of_the_last_one() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "circle")
        quad.control.give_up("revoked", Reason.of(ReasonCode.OFFBOARD_LINK_LOST))
        assert report(quad).reason == Reason.of(ReasonCode.OFFBOARD_LINK_LOST), "so the last queue ended"
        await quad.until(lambda: quad.control.lease is None, "the lease is over")
        quad.take()
        assert report(quad).reason is None
        queue(quad, "segment")
        assert report(quad).reason is None


async def test_an_altitude_above_home_counts_from_home_as_it_is_when_the_task_is_queued() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "circle", relative_altitude_m=20.0)
        home = GlobalPosition(47.397742, 8.545594, 498.0)
        quad.vehicle.put(home=home, home_ned_m=(0.0, 0.0, -10.0))  # 10 m higher than before
        queue(quad, "goto", "replace_all", relative_altitude_m=20.0)
        put_at(quad, 20.0, 10.0)
        await quad.ticks(2)
        newest = quad.sent[-1]
        assert isinstance(newest, LocalTarget)
        assert newest.position == pytest.approx((20.0, 10.0, -30.0), abs=0.01)


@pytest.mark.parametrize("when_exceeded", ["clamp", "refuse"])
@pytest.mark.parametrize(
    ("low", "altitude_m"),
    [({"max_speed_m_s": 2.0}, 20.0), ({"max_descend_m_s": 1.0}, 10.0), ({"max_climb_m_s": 1.0}, 60.0)],
)
async def test_a_task_takes_longer_within_low_limits_whatever_becomes_of_the_clients_setpoints(
    low: dict[str, float], altitude_m: float, when_exceeded: Any
) -> None:
    limits = OffboardLimits(**low, when_exceeded=when_exceeded)
    async with controlled_vehicle(settings=replace(SETTINGS, limits=limits)) as quad:
        point = {"east_m": 20.0, "north_m": 30.0}
        await flying(quad, "goto", point=point, relative_altitude_m=altitude_m)
        await quad.ticks(2)
        assert (report(quad).state, report(quad).reason) == ("flying", None)
        assert author(quad) == "task"
        newest = quad.sent[-1]
        assert isinstance(newest, LocalTarget)
        north, east, down = newest.velocity
        assert north > 0.0
        flown_m_s = {"max_speed_m_s": (north**2 + east**2) ** 0.5, "max_descend_m_s": down, "max_climb_m_s": -down}
        assert {name: flown_m_s[name] for name in low} == pytest.approx(low)
        if when_exceeded == "refuse":
            with pytest.raises(SetpointRefusedError):
                quad.put(north_m_s=20.0, east_m_s=0.0, down_m_s=0.0)
