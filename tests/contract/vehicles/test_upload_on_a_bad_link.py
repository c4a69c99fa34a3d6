"""VehicleLink.upload with lost datagrams and acks, refusals and a second ground station: it ends right or says why."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import aclosing

import pytest

from app.domain.errors import LinkError, UploadError, UploadRefusedError
from app.domain.mission import Mission, MissionType
from app.domain.ports.vehicle_link import VehicleLink
from app.vehicles import LinkSettings
from app.vehicles.mission_wire import first_difference
from tests.support.driving import (
    collected,
    mission,
    opened,
    opened_link,
    rally_point,
    square_fence,
    until,
    uploaded,
    uploaded_without_final_ack,
)
from tests.support.simulated import SimulatedFleet


@pytest.fixture(autouse=True)
def healthy_again(quad: SimulatedFleet) -> Iterator[None]:
    """Each test makes its own faults."""
    yield
    for fault, value in {"loss": 0, "delay_s": 0, "jitter_s": 0, "refuse_upload": 0, "lost_ack": 0}.items():
        quad.control(fault, value)
    quad.control("link_cut", False)


@pytest.mark.parametrize("count", [1, 10, 100])
async def test_with_a_tenth_of_all_datagrams_lost_it_ends_right_or_says_what_failed(
    quad: SimulatedFleet, link: VehicleLink, count: int
) -> None:
    before, sent = mission(5, altitude_m=30.0), mission(count)
    await uploaded(link, before)
    quad.control("loss", 0.1)
    failed: UploadError | None = None
    try:
        await uploaded(link, sent)
    except UploadError as error:
        failed = error
    quad.control("loss", 0.0)
    held = await link.download(MissionType.MISSION)
    expected = sent if failed is None else before
    assert first_difference(expected.items, held) is None, "neither half a mission nor a mixture"
    assert failed is None or failed.extra["mission_type"] in {"fence", "rally", "mission"}


async def test_a_lost_final_ack_is_recognised_as_success(quad: SimulatedFleet, link: VehicleLink) -> None:
    await uploaded(link, mission(3))
    before_id = link.state().mission_id
    last = await uploaded_without_final_ack(quad, link, mission(8))
    assert (last.verified_by, last.attempt) == ("mission_id", 1)
    assert last.mission_id != before_id
    assert first_difference(mission(8).items, await link.download(MissionType.MISSION)) is None


async def test_a_lost_answer_to_clearing_is_asked_for_again(quad: SimulatedFleet, link: VehicleLink) -> None:
    await uploaded(link, Mission(mission(3).items, fence=square_fence(300), rally=(rally_point(20),)))
    quad.control("lost_ack", 3)  # of fence and rally points, and of one of them again
    await uploaded(link, mission(6))
    assert "lost_ack" not in quad.truth(1)["faults"]
    assert await link.download(MissionType.FENCE) == await link.download(MissionType.RALLY) == ()


async def test_a_refusal_of_the_whole_list_is_told_with_its_mav_mission_result(
    quad: SimulatedFleet, link: VehicleLink
) -> None:
    quad.control("refuse_upload", 4)
    with pytest.raises(UploadRefusedError, match="NO_SPACE") as caught:
        await uploaded(link, mission(8))
    assert caught.value.extra["result"] == "NO_SPACE"
    assert caught.value.extra["item_seq"] is None


async def test_a_refusal_of_the_fence_leaves_mission_and_fence_as_they_were(
    quad: SimulatedFleet, link: VehicleLink
) -> None:
    before = mission(5)
    await uploaded(link, before)
    quad.control("refuse_upload", 14)
    changed = mission(9)
    with pytest.raises(UploadRefusedError, match="fence") as caught:
        await uploaded(link, Mission(changed.items, fence=square_fence(300)))
    assert caught.value.extra["mission_type"] == "fence"
    quad.control("refuse_upload", 0)
    assert first_difference(before.items, await link.download(MissionType.MISSION)) is None
    assert await link.download(MissionType.FENCE) == ()


async def test_a_busy_vehicle_is_tried_again_within_the_budget(quad: SimulatedFleet, link: VehicleLink) -> None:
    quad.control("refuse_upload", 1)  # ERROR: what PX4 answers while another transfer is open
    with pytest.raises(UploadError, match="ERROR") as caught:
        await uploaded(link, mission(8))
    assert caught.value.extra["attempts"] == LinkSettings().upload_attempts


async def test_another_station_that_left_a_transfer_open_is_outwaited(quad: SimulatedFleet, link: VehicleLink) -> None:
    await uploaded(link, mission(3))
    for count in (6, 7, 8):  # once, unless a busy machine lets the other transfer end before ours begins
        quad.control("second_gcs", "open_transfer")
        with_fence = Mission(mission(count).items, fence=square_fence(300), rally=(rally_point(20),))
        steps = [step async for step in link.upload(with_fence)]
        assert steps[-1].verified_by is not None
        attempts = max(step.attempt for step in steps if step.mission_type is MissionType.FENCE)
        if attempts > 1:
            break
    assert attempts > 1


async def test_an_old_fence_is_cleared_as_soon_as_another_station_lets_it(
    quad: SimulatedFleet, link: VehicleLink
) -> None:
    await uploaded(link, Mission(mission(3).items, fence=square_fence(300)))
    quad.control("second_gcs", "open_transfer")
    await uploaded(link, mission(6))
    assert await link.download(MissionType.FENCE) == ()


async def test_a_mission_replaced_by_another_station_is_not_taken_for_ours(
    quad: SimulatedFleet, link: VehicleLink
) -> None:
    last = await uploaded(link, mission(6))
    await until(lambda: link.state().mission_id == last.mission_id, "our mission must be shown", 15.0)
    quad.control("second_gcs", "upload")
    await until(lambda: link.state().mission_id != last.mission_id, "the other mission must be shown", 15.0)
    with pytest.raises(LinkError, match="reports mission"):
        await link.wait_mission_ready(mission_id=last.mission_id, rerun=False, timeout_s=1.5)


async def test_on_a_slow_link_an_upload_takes_its_time_and_succeeds(quad: SimulatedFleet, link: VehicleLink) -> None:
    quad.control("delay_s", 0.15)
    quad.control("jitter_s", 0.05)
    last = await uploaded(link, mission(10))
    assert last.verified_by is not None


async def test_a_link_that_breaks_during_an_upload_ends_it_with_an_error(quad: SimulatedFleet) -> None:
    settings = LinkSettings(upload_attempts=2)
    async with (
        opened_link(quad.connections, settings=settings) as link,
        aclosing(link.upload(mission(1000))) as steps,
    ):
        async for step in steps:
            if step.sent > 0:
                break
        quad.control("link_cut", True)
        with pytest.raises(UploadError, match="unknown"):
            await collected(steps)


async def test_close_ends_soon_with_transfers_under_way(quad: SimulatedFleet) -> None:
    async with opened(quad.connections, vehicles=1) as source:
        link = source.links()[0]
        steps = link.upload(mission(1000, altitude_m=40.0))
        async for step in steps:
            if step.sent > 0:
                break
        quad.control("link_cut", True)
        began_s = time.monotonic()
        await source.close()
        assert time.monotonic() - began_s < 15.0
        await steps.aclose()
