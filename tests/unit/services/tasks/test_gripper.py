"""A drop inside a task: only where the vehicle stands, once, and never called done without the vehicle's answer."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator, Sequence
from typing import Any

import pytest

from app.domain.errors import ConflictError, LinkTimeoutError, StorageError
from app.domain.events import Event, EventKind, NewEvent
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.run.run import Run, RunState
from app.domain.vehicle.commands import CommandAck, CommandRequest, MavResult
from app.services.journal import STORED_WITHIN_S
from tests.support.controlled_vehicle import controlled_vehicle
from tests.support.queued_tasks import changes, flying, put_at, queue, report


async def test_it_is_released_where_the_vehicle_stands_and_the_final_answer_ends_the_task() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "goto", gripper="release")
        queue(quad, "circle")
        await quad.ticks(3)
        assert quad.vehicle.releases == [], "not on the way"
        put_at(quad, 20.0, 10.0, velocity_north_m_s=2.0)
        await quad.ticks(3)
        assert quad.vehicle.releases == [], "not on the move"
        put_at(quad, 20.0, 10.0, velocity_north_m_s=0.1)
        await quad.until(lambda: report(quad).task_list == [2], "the answer ends the task")
        (request,) = quad.vehicle.releases
        assert (request.params[1], request.attempts) == (0.0, 1)
        told = [(event["task_id"], event["action"], event["outcome"]) for event in await quad.recorded("task.gripper")]
        assert told == [("t1", "release", "sent"), ("t1", "release", "done")]


@pytest.mark.parametrize(
    ("answer", "said", "outcome"),
    [
        ([MavResult.FAILED], "FAILED", "failed"),
        ([MavResult.IN_PROGRESS, MavResult.CANCELLED], "CANCELLED", "failed"),
        (LinkTimeoutError("no final acknowledgement of DO_GRIPPER"), "no final ack", "unknown"),
    ],
)
async def test_any_other_answer_stops_the_queue_and_is_not_tried_again_unasked(
    answer: object, said: str, outcome: str
) -> None:
    async with controlled_vehicle() as quad:
        quad.vehicle.answers = [answer]  # type: ignore[list-item]
        await flying(quad, "goto", gripper="release")
        put_at(quad, 20.0, 10.0)
        await quad.until(lambda: report(quad).state == "paused", "it must stand")
        await quad.ticks(5)
        assert said in describe(report(quad).reason)
        assert (report(quad).task_list, len(quad.vehicle.releases)) == ([1], 1)
        assert (await changes(quad))[-1] == ("blocked", "t1")
        assert [event["outcome"] for event in await quad.recorded("task.gripper")] == ["sent", outcome]
        quad.tasks.resume(quad.lease)
        await quad.until(lambda: len(quad.vehicle.releases) == 2, "a pilot may try again")


async def test_nothing_is_sent_that_cannot_be_recorded() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "goto", gripper="release")
        full = StorageError("the disk is full")
        quad.events.refuse = lambda event: full if event.kind is EventKind.TASK_GRIPPER else None
        put_at(quad, 20.0, 10.0)
        await quad.until(lambda: report(quad).state == "paused", "it must stand")
        assert quad.vehicle.releases == []
        assert "the disk is full" in describe(report(quad).reason)


async def test_nothing_is_sent_that_is_recorded_too_late() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "goto", gripper="release")
        append = quad.events.append

        async def stalls(events: Sequence[NewEvent], *others: Any) -> Sequence[Event]:
            if any(event.kind is EventKind.TASK_GRIPPER for event in events):
                await asyncio.sleep(1.2 * STORED_WITHIN_S)
            return await append(events, *others)

        quad.events.append = stalls  # type: ignore[method-assign]
        put_at(quad, 20.0, 10.0)
        await quad.until(lambda: report(quad).state == "paused", "the vehicle may be elsewhere by now")
        assert quad.vehicle.releases == []
        assert [event["outcome"] for event in await quad.recorded("task.gripper")] == ["sent", "failed"]


async def test_a_release_whose_task_ends_before_the_answer_is_not_known_and_says_so() -> None:
    async with controlled_vehicle() as quad:
        sent = asyncio.Event()

        async def silent(request: CommandRequest) -> AsyncGenerator[CommandAck, None]:
            sent.set()
            await asyncio.Event().wait()
            yield CommandAck(request.command, 0)

        quad.vehicle.command = silent  # type: ignore[method-assign]
        await flying(quad, "goto", gripper="release")
        put_at(quad, 20.0, 10.0)
        await asyncio.wait_for(sent.wait(), 10.0)
        quad.control.release(quad.lease, Reason.of(ReasonCode.OFFBOARD_RELEASED))
        await quad.ticks(0)
        results = [event["outcome"] for event in await quad.recorded("task.gripper")]
        assert results == ["sent", "unknown"]


@pytest.mark.parametrize("mode", ["prepend", "replace_current", "replace_all"])
async def test_nothing_takes_its_place_while_the_gripper_works_or_it_would_work_twice(mode: str) -> None:
    async with controlled_vehicle() as quad:
        sent, answer, original = asyncio.Event(), asyncio.Event(), quad.vehicle.command

        async def slow(request: CommandRequest) -> AsyncGenerator[CommandAck, None]:
            sent.set()
            await answer.wait()
            async for ack in original(request):
                yield ack

        quad.vehicle.command = slow  # type: ignore[method-assign]
        await flying(quad, "goto", gripper="release")
        put_at(quad, 20.0, 10.0)
        await asyncio.wait_for(sent.wait(), 10.0)
        with pytest.raises(ConflictError, match="twice"):
            queue(quad, "goto", mode)
        later = queue(quad, "circle")
        for task_id, before in ((later, "t1"), ("t1", None)):
            with pytest.raises(ConflictError, match="twice"):
                quad.tasks.move(quad.lease, task_id, before)
        answer.set()
        await quad.until(lambda: report(quad).task_list == [2], "the answer ends the task")
        assert len(quad.vehicle.releases) == 1
        queue(quad, "goto", mode)


async def test_a_grab_is_a_grab() -> None:
    async with controlled_vehicle() as quad:
        await flying(quad, "goto", gripper="grab")
        put_at(quad, 20.0, 10.0)
        await quad.until(lambda: "DO_GRIPPER 1" in quad.vehicle.sent, "it grabs")
        assert quad.vehicle.releases == []


async def test_the_vehicles_run_is_told_before_anything_is_sent() -> None:
    run = Run(id="r1", plan_id="p", plan_hash="h", vehicle_id="v1", created_at=1.0, updated_at=1.0)
    async with controlled_vehicle(run=run.model_copy(update={"state": RunState.PAUSED})) as quad:
        releases_then: list[int] = []

        async def told(run_id: str) -> None:
            assert run_id == "r1"
            releases_then.append(len(quad.vehicle.releases))

        quad.runs.use_gripper = told  # type: ignore[method-assign]
        await flying(quad, "goto", gripper="release")
        put_at(quad, 20.0, 10.0)
        await quad.until(lambda: len(quad.vehicle.releases) == 1, "it must be released")
        assert releases_then == [0], "its drops cannot tell any more whose release it was"


async def test_nothing_is_sent_that_the_run_cannot_store() -> None:
    run = Run(id="r1", plan_id="p", plan_hash="h", vehicle_id="v1", created_at=1.0, updated_at=1.0)
    async with controlled_vehicle(run=run.model_copy(update={"state": RunState.PAUSED})) as quad:

        async def full(run_id: str) -> None:
            raise StorageError("the disk is full")

        quad.runs.use_gripper = full  # type: ignore[method-assign]
        await flying(quad, "goto", gripper="release")
        put_at(quad, 20.0, 10.0)
        await quad.until(lambda: report(quad).state == "paused", "it must stand")
        assert quad.vehicle.releases == []
        assert [event["outcome"] for event in await quad.recorded("task.gripper")] == ["sent", "failed"]


async def test_a_command_that_was_overtaken_while_it_was_stored_is_not_said_to_be_stored_too_late() -> None:
    run = Run(id="r1", plan_id="p", plan_hash="h", vehicle_id="v1", created_at=1.0, updated_at=1.0)
    async with controlled_vehicle(run=run.model_copy(update={"state": RunState.PAUSED})) as quad:

        async def pauses_it(run_id: str) -> None:
            quad.tasks.pause(quad.lease)

        quad.runs.use_gripper = pauses_it  # type: ignore[method-assign]
        await flying(quad, "goto", gripper="release")
        put_at(quad, 20.0, 10.0)
        await quad.until(lambda: report(quad).state == "paused", "it must stand")
        await quad.ticks(2)
        assert quad.vehicle.releases == []
        *_, last = await quad.recorded("task.gripper")
        assert "no longer had the vehicle" in describe(Reason.model_validate_json(json.dumps(last["reason"])))
