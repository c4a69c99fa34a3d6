"""VehicleLink.command: each ack to us, the last one final, and nothing taken for an answer that is none."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator

import pytest

from app.domain.errors import ConflictError, LinkError, LinkTimeoutError
from app.domain.mission import NAN, MavCmd
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.vehicle.commands import CommandAck, CommandRequest, MavResult
from app.domain.vehicle.facts import GripperOutput
from tests.support.driving import ReceivedFacts, armed, opened, until
from tests.support.simulated import SimulatedFleet

RELEASE, GRAB = 0.0, 1.0


def gripper(action: float, **more: float) -> CommandRequest:
    return CommandRequest(MavCmd.DO_GRIPPER, (1.0, action, NAN, NAN, NAN, NAN, NAN), **more)  # type: ignore[arg-type]


async def acks_of(link: VehicleLink, request: CommandRequest) -> list[CommandAck]:
    return [ack async for ack in link.command(request)]


@pytest.fixture
async def quiet_link(link: VehicleLink) -> VehicleLink:
    """The link when it has set its streams up: no command but the test's own is under way."""
    await until(lambda: link.state().gripper_output_us is not None, "the gripper's channel must be found", 10.0)
    return link


@pytest.fixture(autouse=True)
def healthy_again(quad: SimulatedFleet) -> Iterator[None]:
    yield
    quad.control("lost_ack", 0)
    quad.control("link_cut", False)
    quad.control("slow_gripper", 0.0)


async def test_a_gripper_command_is_in_progress_and_then_accepted(link: VehicleLink) -> None:
    await acks_of(link, gripper(GRAB))
    acks = await acks_of(link, gripper(RELEASE))
    assert [ack.result for ack in acks] == [MavResult.IN_PROGRESS, MavResult.ACCEPTED]
    assert [ack.is_final for ack in acks] == [False, True]


async def test_a_gripper_already_there_is_accepted_at_once(link: VehicleLink) -> None:
    await acks_of(link, gripper(RELEASE))
    acks = await acks_of(link, gripper(RELEASE))
    assert [ack.result for ack in acks] == [MavResult.ACCEPTED]


async def test_a_refusal_is_given_back_as_it_came_and_raises_nothing(link: VehicleLink) -> None:
    acks = await acks_of(link, gripper(5.0))
    assert [ack.result for ack in acks] == [MavResult.DENIED]


async def test_a_command_that_the_vehicle_does_not_know_is_unsupported(link: VehicleLink) -> None:
    request = CommandRequest(MavCmd.NAV_RALLY_POINT, (NAN,) * 7)
    assert [ack.result for ack in await acks_of(link, request)] == [MavResult.UNSUPPORTED]


async def test_the_same_command_twice_at_once_is_a_conflict_and_not_queued(link: VehicleLink) -> None:
    await acks_of(link, gripper(GRAB))
    first = asyncio.create_task(acks_of(link, gripper(RELEASE)))
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    with pytest.raises(ConflictError, match="DO_GRIPPER"):
        await acks_of(link, gripper(GRAB))
    assert (await first)[-1].result is MavResult.ACCEPTED


async def test_other_commands_are_answered_while_one_is_in_progress(quad: SimulatedFleet, link: VehicleLink) -> None:
    await acks_of(link, gripper(GRAB))
    quad.control("slow_gripper", 5.0)
    release = link.command(gripper(RELEASE))
    first = await anext(release)
    assert first.result is MavResult.IN_PROGRESS
    await link.hold()
    assert [ack.result async for ack in release] == [MavResult.ACCEPTED]


async def test_a_lost_ack_is_asked_for_again(quad: SimulatedFleet, quiet_link: VehicleLink) -> None:
    await acks_of(quiet_link, gripper(RELEASE))
    quad.control("lost_ack", 1)
    acks = await acks_of(quiet_link, gripper(RELEASE, timeout_s=0.3, attempts=3))
    assert acks[-1].result is MavResult.ACCEPTED


async def test_one_attempt_without_an_answer_is_a_timeout_and_is_not_repeated(
    quad: SimulatedFleet, quiet_link: VehicleLink
) -> None:
    await acks_of(quiet_link, gripper(RELEASE))
    quad.control("lost_ack", 1)  # a second one would be answered
    began_s = time.monotonic()
    with pytest.raises(LinkTimeoutError, match="1 attempt without an answer") as caught:
        await acks_of(quiet_link, gripper(RELEASE, timeout_s=0.3, attempts=1))
    assert time.monotonic() - began_s >= 0.3
    assert "unknown" in caught.value.hint


async def test_in_progress_without_an_end_is_a_timeout(quad: SimulatedFleet, quiet_link: VehicleLink) -> None:
    await acks_of(quiet_link, gripper(GRAB))
    quad.control("lost_ack", 1)
    with pytest.raises(LinkTimeoutError, match="IN_PROGRESS"):
        await acks_of(quiet_link, gripper(RELEASE, in_progress_timeout_s=1.0))


async def test_a_command_whose_generator_is_closed_leaves_the_way_free(link: VehicleLink) -> None:
    await acks_of(link, gripper(GRAB))
    release = link.command(gripper(RELEASE))
    await anext(release)
    await release.aclose()  # type: ignore[attr-defined]
    await until(lambda: True, "", 0.0)
    assert (await acks_of(link, gripper(GRAB)))[-1].is_final


async def test_close_ends_a_command_that_waits(quad: SimulatedFleet) -> None:
    async with opened(quad.connections, vehicles=1) as source:
        link = source.links()[0]
        quad.control("link_cut", True)
        waiting = asyncio.create_task(acks_of(link, gripper(RELEASE, timeout_s=30.0)))
        await asyncio.sleep(0)
        await source.close()
        with pytest.raises(LinkError, match="closed"):
            await asyncio.wait_for(waiting, 1.0)
        with pytest.raises(LinkError, match="closed"):
            await link.arm()


async def test_the_grippers_output_is_seen(link: VehicleLink) -> None:
    await acks_of(link, gripper(GRAB))
    received = ReceivedFacts(link)
    await armed(link)
    await until(lambda: link.state().gripper_output_us == 2000, "armed and grabbed is 2000 us", 15.0)
    await acks_of(link, gripper(RELEASE))
    await until(lambda: link.state().gripper_output_us == 1000, "released is 1000 us", 15.0)
    assert link.state().gripper_output_age_s is not None
    await link.disarm()
    await until(lambda: link.state().gripper_output_us == 900, "disarmed is 900 us", 15.0)
    outputs = [fact.output_us for fact in received.of(GripperOutput)]
    assert outputs[-2:] == [1000, 900]
    assert outputs == [one for n, one in enumerate(outputs) if n == 0 or one != outputs[n - 1]]
