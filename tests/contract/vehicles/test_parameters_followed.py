"""Parameters that another ground station sets, over its own link."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Iterator
from typing import NamedTuple

import pytest

from app.domain.errors import LinkTimeoutError
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.vehicle.facts import LinkLost, LinkRestored, ParametersChanged
from tests.support.driving import ReceivedFacts, opened_link, until
from tests.support.second_station import SecondStation
from tests.support.simulated import SimulatedFleet


class Stage(NamedTuple):
    fleet: SimulatedFleet
    station: SecondStation
    link: VehicleLink

    async def set(self, name: str, value: float) -> None:
        await asyncio.to_thread(self.station.set, name, value)

    async def value(self, *, fresh: bool = False, name: str) -> float | None:
        return (await self.link.read_facts(fresh=fresh)).parameters.get(name)


@pytest.fixture
def fleet() -> Iterator[tuple[SimulatedFleet, SecondStation]]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = int(probe.getsockname()[1])
    with SecondStation(port) as station, SimulatedFleet("quad", speed=3.0, gcs_port=str(port)) as fleet:
        yield fleet, station


@pytest.fixture
async def stage(fleet: tuple[SimulatedFleet, SecondStation]) -> AsyncIterator[Stage]:
    async with opened_link(fleet[0].connections) as link:
        await link.read_facts()
        yield Stage(*fleet, link)


async def test_a_change_that_the_vehicle_announces_is_known_and_told(stage: Stage) -> None:
    received = ReceivedFacts(stage.link)
    before = await stage.link.read_facts()
    await stage.set("NAV_ACC_RAD", 3.5)
    assert (await received.until(ParametersChanged, 5.0)).parameters == {"NAV_ACC_RAD": 3.5}
    assert await stage.value(name="NAV_ACC_RAD") == 3.5
    assert before.parameters["NAV_ACC_RAD"] == 10.0, "facts that were given away stay as they were"


async def test_a_negative_integer_that_is_announced_is_read(stage: Stage) -> None:
    received = ReceivedFacts(stage.link)
    await stage.set("PD_GRIPPER_TYPE", -1)
    assert (await received.until(ParametersChanged, 10.0)).parameters == {"PD_GRIPPER_TYPE": -1}
    await stage.set("PD_GRIPPER_TYPE", 0)
    assert (await received.until(ParametersChanged, 10.0, after=1)).parameters == {"PD_GRIPPER_TYPE": 0}


async def test_what_the_vehicle_does_not_announce_is_read_again_for_a_start(stage: Stage) -> None:
    received = ReceivedFacts(stage.link)
    assert await stage.value(name="MIS_TKO_LAND_REQ") == 0
    await stage.set("MIS_TKO_LAND_REQ", 4)
    assert await stage.value(name="MIS_TKO_LAND_REQ", fresh=True) == 4
    assert received.of(ParametersChanged)[-1].parameters == {"MIS_TKO_LAND_REQ": 4}


async def test_a_vehicle_that_does_not_answer_keeps_nobody_waiting_and_the_age_is_told(stage: Stage) -> None:
    received = ReceivedFacts(stage.link)
    stage.fleet.control("link_cut", True)
    await received.until(LinkLost, 15.0)
    with pytest.raises(LinkTimeoutError, match="could not be read again"):
        await asyncio.wait_for(stage.link.read_facts(fresh=True), 15.0)
    facts = await asyncio.wait_for(stage.link.read_facts(), 15.0)
    assert facts.parameters_age_s is not None
    assert facts.parameters_age_s > 3.0
    stage.fleet.control("link_cut", False)
    await received.until(LinkRestored, 15.0)
    again = await stage.link.read_facts(fresh=True)
    assert again.parameters == facts.parameters
    assert again.parameters_age_s is not None
    assert again.parameters_age_s < facts.parameters_age_s


async def test_an_announcement_that_was_not_heard_is_found_by_the_checksum(stage: Stage) -> None:
    """The same value sent again before the announcement: PX4 takes it for saved, and tells nobody."""
    received = ReceivedFacts(stage.link)
    await asyncio.to_thread(stage.station.set_silently, "NAV_ACC_RAD", 3.5)
    facts = await stage.link.read_facts(fresh=True)
    assert facts.parameters["NAV_ACC_RAD"] == 3.5
    assert received.of(ParametersChanged)[-1].parameters == {"NAV_ACC_RAD": 3.5}


async def test_a_gripper_output_that_is_taken_away_and_given_again_is_noticed(stage: Stage) -> None:
    def output() -> int | None:
        return stage.link.state().gripper_output_us

    await until(lambda: output() is not None, "the gripper's output must be seen", 15.0)
    await stage.set("PWM_MAIN_FUNC5", 0)
    await until(lambda: output() is None, "no output is the gripper's", 10.0)
    await stage.set("PWM_MAIN_FUNC5", 430)
    await until(lambda: output() is not None, "the output must be seen again", 15.0)
