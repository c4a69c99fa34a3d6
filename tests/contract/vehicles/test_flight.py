"""VehicleLink in flight: ready, armed, started, held, resumed, returned, landed, and every item reached once."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator, Iterator
from dataclasses import replace

import pytest

from app.domain.errors import LinkTimeoutError, VehicleRefusedError
from app.domain.mission import MavCmd, MavFrame, Mission, MissionItem
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.vehicle.facts import ItemReached, MissionCurrent, StateChanged
from app.domain.vehicle.state import FlightMode, LandedState, MissionState
from tests.support.driving import (
    ReceivedFacts,
    armed,
    flying,
    mission,
    opened_link,
    square_fence,
    until,
    uploaded,
    waypoint,
)
from tests.support.simulated import SimulatedFleet


@pytest.fixture(scope="module")
def fleet() -> Iterator[SimulatedFleet]:
    """Faster than the shared one: these tests fly."""
    with SimulatedFleet("quad", speed=10.0) as found:
        yield found


@pytest.fixture
async def link(fleet: SimulatedFleet) -> AsyncIterator[VehicleLink]:
    """The link, with the vehicle landed and disarmed afterwards."""
    async with opened_link(fleet.connections) as found:
        yield found
        if found.state().armed:
            await found.land()
            await until(lambda: found.state().armed is False, "the vehicle must land and disarm", 30.0)


async def test_arming_is_refused_with_the_vehicles_reason_until_its_checks_pass() -> None:
    with SimulatedFleet("quad", speed=3.0) as blind:
        blind.control("gps_loss", True)
        async with opened_link(blind.connections) as link:
            with pytest.raises(VehicleRefusedError) as caught:
                await link.arm()
            assert caught.value.extra["result"] == "TEMPORARILY_REJECTED"
            assert any("Arming denied" in text for text in caught.value.extra["texts"])  # type: ignore[attr-defined]
            blind.control("gps_loss", False)
            await armed(link, within_s=15.0)
            await until(lambda: link.state().armed is True, "HEARTBEAT must show it armed", 15.0)
            await link.disarm()
            await until(lambda: link.state().armed is False, "HEARTBEAT must show it disarmed", 15.0)


async def test_a_mission_is_ready_when_the_vehicle_shows_its_id_and_not_earlier(link: VehicleLink) -> None:
    last = await uploaded(link, mission(5))
    acked_s = time.monotonic()
    await link.wait_mission_ready(mission_id=last.mission_id, rerun=False, timeout_s=10.0)
    assert link.state().mission_state is MissionState.NOT_STARTED
    assert link.state().mission_id == last.mission_id
    assert time.monotonic() - acked_s >= 0.05 - 0.01


async def test_a_mission_with_another_id_is_never_ready(link: VehicleLink) -> None:
    await uploaded(link, mission(5))
    with pytest.raises(LinkTimeoutError, match="instead of 12345"):
        await link.wait_mission_ready(mission_id=12345, rerun=False, timeout_s=0.5)


async def test_an_infeasible_mission_is_refused_with_the_vehicles_texts(link: VehicleLink) -> None:
    outside = Mission(mission(4, north_m=400).items, fence=square_fence(100))
    last = await uploaded(link, outside)
    assert last.verified_by is not None, "an accepted upload is not a valid mission"
    with pytest.raises(VehicleRefusedError, match="infeasible") as caught:
        await link.wait_mission_ready(mission_id=last.mission_id, rerun=False, timeout_s=10.0)
    assert any("fence" in text.lower() for text in caught.value.extra["texts"])  # type: ignore[attr-defined]


async def test_a_reason_that_comes_only_as_an_event_is_told_in_words(link: VehicleLink) -> None:
    items = (waypoint(0, 0), waypoint(1, 5, command=MavCmd.NAV_TAKEOFF), waypoint(2, 10))
    last = await uploaded(link, Mission(items))
    with pytest.raises(VehicleRefusedError) as caught:
        await link.wait_mission_ready(mission_id=last.mission_id, rerun=False, timeout_s=10.0)
    assert any("takeoff is not the first" in t for t in caught.value.extra["texts"])  # type: ignore[attr-defined]


async def test_starting_without_a_mission_is_refused(link: VehicleLink) -> None:
    outside = Mission(mission(4, north_m=400).items, fence=square_fence(100))
    await uploaded(link, outside)
    await until(lambda: link.state().mission_state is MissionState.NO_MISSION, "it must be infeasible", 15.0)
    await armed(link)
    with pytest.raises(VehicleRefusedError, match="mission mode"):
        await link.start_mission()
    await link.disarm()


async def test_a_flight_starts_holds_resumes_returns_and_lands(link: VehicleLink) -> None:
    """On a leg of ten seconds: no item ends between the holding and the resuming."""
    received, modes = ReceivedFacts(link), list[FlightMode | None]()
    await flying(link, mission(4, north_m=800))
    assert link.state().mode is FlightMode.MISSION
    assert link.state().armed is True
    await until(lambda: link.state().mission_seq == 1, "it must be on the long leg", 15.0)
    await link.hold()
    assert link.state().mode is FlightMode.HOLD
    await link.start_mission()
    assert link.state().mode is FlightMode.MISSION
    assert link.state().mission_seq == 1
    await link.return_to_launch()
    assert link.state().mode is FlightMode.RETURN
    link.subscribe(lambda fact: modes.append(link.state().mode))  # it may be down before this test looks
    await link.land()
    assert FlightMode.LAND in modes
    await until(lambda: link.state().armed is False, "the vehicle must land and disarm", 30.0)
    assert link.state().landed is LandedState.ON_GROUND
    assert received.of(StateChanged)


async def test_each_item_is_reached_once_per_visit(link: VehicleLink) -> None:
    received = ReceivedFacts(link)
    await flying(link, mission(6, north_m=10))
    await until(lambda: link.state().armed is False, "the mission must end on the ground", 60.0)
    reached = [fact.seq for fact in received.of(ItemReached)]
    assert reached == sorted(set(reached)), "PX4 repeats each about ten times"
    assert {1, 2, 3} <= set(reached)  # the last one before RTL may never be reported


async def test_an_item_visited_again_by_a_jump_is_reached_again(link: VehicleLink) -> None:
    received = ReceivedFacts(link)
    jump = MissionItem(3, MavFrame.MISSION, MavCmd.DO_JUMP, 1.0, 1.0, 0.0, 0.0)
    items = (waypoint(0, 0, command=MavCmd.NAV_TAKEOFF), waypoint(1, 20), waypoint(2, 60), jump)
    home = replace(mission(6).items[5], seq=5)
    await flying(link, Mission((*items, waypoint(4, 70), home)))
    await until(lambda: link.state().armed is False, "the mission must end on the ground", 60.0)
    reached = [fact.seq for fact in received.of(ItemReached) if fact.seq in {1, 2}]
    assert reached == [1, 2, 1, 2]


async def test_a_finished_mission_can_be_flown_again_without_an_upload(link: VehicleLink) -> None:
    await flying(link, mission(3, north_m=60))  # it is seen to climb before it is down again
    await until(lambda: link.state().armed is False, "the mission must end on the ground", 60.0)
    mission_id = link.state().mission_id
    await link.wait_mission_ready(mission_id=mission_id, rerun=True, timeout_s=5.0)
    await link.set_current(0)
    await armed(link)
    await link.start_mission()
    await until(lambda: (link.state().relative_altitude_m or 0.0) > 3.0, "it must climb again", 20.0)


async def test_set_current_in_flight_moves_the_mission_on(link: VehicleLink) -> None:
    received = ReceivedFacts(link)
    await flying(link, mission(8, north_m=60))
    await link.set_current(5)
    await until(lambda: link.state().mission_seq == 5, "MISSION_CURRENT must show it", 15.0)
    assert received.of(MissionCurrent)[-1].seq == 5


async def test_set_current_while_holding_takes_effect_on_resuming(link: VehicleLink) -> None:
    await flying(link, mission(8, north_m=60))
    await link.hold()
    await link.set_current(4)
    await link.start_mission()
    await until(lambda: link.state().mission_seq == 4, "the mission must go on at item 4", 15.0)


async def test_set_current_beyond_the_mission_is_refused(link: VehicleLink) -> None:
    await uploaded(link, mission(5))
    with pytest.raises(VehicleRefusedError) as caught:
        await link.set_current(99)
    assert caught.value.extra["item_seq"] == 99
