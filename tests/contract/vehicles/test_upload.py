"""VehicleLink.upload: what was sent is what the vehicle holds, or the error says what is wrong and where."""

from __future__ import annotations

import asyncio
import gc
from contextlib import aclosing
from dataclasses import replace

import pytest

from app.domain.errors import UploadError
from app.domain.mission import MavCmd, MavFrame, Mission, MissionItem, MissionType
from app.domain.ports.vehicle_link import VehicleLink
from app.vehicles.mission_upload import UploadAttempt
from app.vehicles.mission_wire import first_difference
from tests.support.driving import mission, rally_point, square_fence, until, uploaded


@pytest.mark.parametrize("count", [1, 10, 100, 1000])
async def test_an_upload_is_held_by_the_vehicle_item_by_item(link: VehicleLink, count: int) -> None:
    sent = mission(count)
    last = await uploaded(link, sent)
    assert last.verified_by in {"mission_id", "read_back"}
    held = await link.download(MissionType.MISSION)
    assert len(held) == count
    assert all(one.same_as(other) for one, other in zip(sent.items, held, strict=True))


async def test_nan_stays_nan_on_the_vehicle(link: VehicleLink) -> None:
    items = (*mission(2).items[:1], MissionItem(1, MavFrame.MISSION, MavCmd.DO_GRIPPER, 1.0, 0.0))
    await uploaded(link, Mission(items))
    held = await link.download(MissionType.MISSION)
    assert held[1].param3 != held[1].param3
    assert held[1].param2 == 0.0


async def test_exactly_the_first_item_is_current(link: VehicleLink) -> None:
    await uploaded(link, mission(3))
    assert [item.current for item in await link.download(MissionType.MISSION)] == [True, False, False]


async def test_progress_grows_to_the_total_and_only_the_last_step_is_verified(link: VehicleLink) -> None:
    steps = [step async for step in link.upload(mission(1000))]
    sent = [step.sent for step in steps]
    assert sent == sorted(sent)
    assert (sent[0], sent[-1]) == (0, 1000)
    assert len(steps) > 2
    assert [step.verified_by is not None for step in steps] == [False] * (len(steps) - 1) + [True]


async def test_the_id_of_the_upload_is_the_one_the_vehicle_then_shows(link: VehicleLink) -> None:
    last = await uploaded(link, mission(6))
    assert last.mission_id is not None
    await until(lambda: link.state().mission_id == last.mission_id, "MISSION_CURRENT must show the mission", 15.0)


async def test_fence_and_rally_points_go_first_and_are_verified(link: VehicleLink) -> None:
    sent = Mission(mission(4).items, fence=square_fence(200), rally=(rally_point(20),))
    steps = [step async for step in link.upload(sent)]
    assert list(dict.fromkeys(step.mission_type for step in steps)) == [
        MissionType.FENCE,
        MissionType.RALLY,
        MissionType.MISSION,
    ]
    assert [step.mission_type for step in steps if step.verified_by] == [
        MissionType.FENCE,
        MissionType.RALLY,
        MissionType.MISSION,
    ]
    assert first_difference(sent.fence, await link.download(MissionType.FENCE)) is None
    assert first_difference(sent.rally, await link.download(MissionType.RALLY)) is None


async def test_a_mission_without_fence_clears_the_stale_one_of_an_earlier_flight(link: VehicleLink) -> None:
    await uploaded(link, Mission(mission(3).items, fence=square_fence(200), rally=(rally_point(20),)))
    await uploaded(link, mission(3))
    assert await link.download(MissionType.FENCE) == ()
    assert await link.download(MissionType.RALLY) == ()


async def test_a_refused_item_is_named_and_the_old_mission_stays(link: VehicleLink) -> None:
    before = mission(5)
    await uploaded(link, before)
    bad = MissionItem(3, MavFrame.GLOBAL_RELATIVE_ALT_INT, MavCmd.DO_GRIPPER, 1.0, 0.0, x=473977420, y=85455940)
    items = (*mission(6).items[:3], bad, replace(mission(6).items[4]), mission(6).items[5])
    with pytest.raises(UploadError) as caught:
        await uploaded(link, Mission(items))
    assert caught.value.extra["item_seq"] == 3
    assert str(caught.value.extra["result"]).startswith(("INVALID", "UNSUPPORTED"))
    assert "item 3 (DO_GRIPPER)" in caught.value.detail
    held = await link.download(MissionType.MISSION)
    assert first_difference(before.items, held) is None


async def test_a_mission_without_items_is_refused_before_anything_is_sent(link: VehicleLink) -> None:
    before = Mission(mission(3).items, fence=square_fence(200))
    await uploaded(link, before)
    with pytest.raises(UploadError, match="without items"):
        await uploaded(link, Mission(()))
    assert len(await link.download(MissionType.FENCE)) == 4


async def test_a_closed_upload_is_cancelled_and_the_next_one_works(link: VehicleLink) -> None:
    before = mission(4)
    await uploaded(link, before)
    async with aclosing(link.upload(mission(1000, altitude_m=20.0))) as steps:
        async for step in steps:
            if 0 < step.sent < 900:
                break
    held = await link.download(MissionType.MISSION)
    assert first_difference(before.items, held) is None, "a cancelled upload must leave the old mission"
    await uploaded(link, mission(7))


async def test_a_cancelled_task_cancels_its_upload(link: VehicleLink) -> None:
    await uploaded(link, mission(4))
    task = asyncio.create_task(uploaded(link, mission(1000, altitude_m=25.0)))
    await asyncio.sleep(0)
    await asyncio.sleep(0.02)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    await uploaded(link, mission(5))
    assert len(await link.download(MissionType.MISSION)) == 5


async def test_uploads_of_one_vehicle_wait_for_each_other(link: VehicleLink) -> None:
    first, second = mission(300, altitude_m=15.0), mission(40)
    await asyncio.gather(uploaded(link, first), uploaded(link, second))
    held = await link.download(MissionType.MISSION)
    assert first_difference(second.items, held) is None, "the one that came last counts"


async def test_the_same_mission_again_has_the_same_id(link: VehicleLink) -> None:
    one = await uploaded(link, mission(12))
    two = await uploaded(link, mission(12))
    assert one.mission_id == two.mission_id


async def test_an_upload_that_has_ended_is_kept_nowhere(link: VehicleLink) -> None:
    before = len(_attempts())
    for count in (3, 4, 5):
        await uploaded(link, mission(count))
    await until(lambda: len(_attempts()) <= before, "ended uploads must be freed", 20.0)


def _attempts() -> list[object]:
    gc.collect()
    return [one for one in gc.get_objects() if isinstance(one, UploadAttempt)]
