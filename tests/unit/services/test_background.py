"""A task ends with its owner, and one that ends earlier by a defect does not end unseen."""

from __future__ import annotations

import asyncio

from structlog.testing import capture_logs

from app.services.background import background, begin_task, end_tasks


async def for_ever(ended: list[str]) -> None:
    try:
        await asyncio.Event().wait()
    finally:
        await asyncio.sleep(0)
        ended.append("ended")


async def fail() -> None:
    raise RuntimeError("a defect")


async def test_work_has_ended_when_its_block_ends() -> None:
    ended: list[str] = []
    async with background(for_ever(ended), "work"):
        await asyncio.sleep(0)
        assert not ended
    assert ended == ["ended"]


async def test_a_defect_is_logged_with_the_name_of_its_part() -> None:
    with capture_logs() as logs:
        async with background(fail(), "some part"):
            await asyncio.sleep(0.01)
    assert [(line["log_level"], line["part"]) for line in logs] == [("error", "some part")]


async def test_all_tasks_have_ended_even_if_some_failed_or_never_began() -> None:
    ended: list[str] = []
    tasks = [begin_task(for_ever(ended), "first"), begin_task(fail(), "second"), None]
    with capture_logs():
        await asyncio.sleep(0)
        await end_tasks(*tasks)
    assert ended == ["ended"]
