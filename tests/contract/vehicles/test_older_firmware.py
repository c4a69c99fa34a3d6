"""PX4 v1.14: no mission ids, no mission_state, no PARAM_ERROR. Uploads are read back instead."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator

import pytest

from app.domain.mission import MissionType
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.vehicle.state import FlightMode, MissionState
from app.vehicles.mission_wire import first_difference
from tests.support.driving import armed, flying, mission, opened_link, until, uploaded, uploaded_without_final_ack
from tests.support.simulated import SimulatedFleet


@pytest.fixture(scope="module")
def old_quad() -> Iterator[SimulatedFleet]:
    with SimulatedFleet("quad", speed=5.0, firmware="px4-1.14") as fleet:
        yield fleet


@pytest.fixture
async def link(old_quad: SimulatedFleet) -> AsyncIterator[VehicleLink]:
    async with opened_link(old_quad.connections) as found:
        yield found


async def test_an_upload_is_verified_by_reading_it_back(link: VehicleLink) -> None:
    last = await uploaded(link, mission(20))
    assert (last.verified_by, last.mission_id) == ("read_back", None)
    assert first_difference(mission(20).items, await link.download(MissionType.MISSION)) is None


async def test_a_lost_final_ack_is_recognised_by_reading_back(old_quad: SimulatedFleet, link: VehicleLink) -> None:
    last = await uploaded_without_final_ack(old_quad, link, mission(9))
    assert (last.verified_by, last.attempt) == ("read_back", 1)


async def test_a_mission_can_be_started_although_no_state_is_reported(link: VehicleLink) -> None:
    await uploaded(link, mission(6))
    await link.wait_mission_ready(mission_id=None, rerun=False, timeout_s=10.0)
    assert link.state().mission_state is MissionState.UNKNOWN
    await armed(link)
    await link.start_mission()
    await until(lambda: (link.state().relative_altitude_m or 0.0) > 3.0, "the vehicle must climb", 20.0)
    await link.land()


async def test_facts_tell_the_version_and_leave_out_what_it_does_not_know(link: VehicleLink) -> None:
    facts = await link.read_facts()
    assert str(facts.firmware).startswith("1.14.")
    assert "PWM_AUX_FUNC1" not in facts.parameters
    assert facts.parameters["NAV_ACC_RAD"] > 0


async def test_without_an_intended_mode_a_warning_is_told_from_a_failsafe_that_acts() -> None:
    """Before v1.15 HEARTBEAT alone says CRITICAL, for both."""
    with SimulatedFleet("quad", speed=4.0, firmware="px4-1.14", params="COM_LOW_BAT_ACT=3,COM_FAIL_ACT_T=15") as fleet:
        async with opened_link(fleet.connections) as link:
            await flying(link, mission(4, north_m=800))
            fleet.control("battery_percent", 12.0)
            await until(lambda: link.state().is_critical, "the warning must show", 20.0)
            assert (link.state().mode, link.state().in_failsafe) == (FlightMode.MISSION, False)
            fleet.control("battery_percent", 6.9)
            await until(lambda: link.state().mode is FlightMode.HOLD, "it must hold before it returns", 20.0)
            assert link.state().in_failsafe
            await until(lambda: link.state().mode is FlightMode.RETURN, "it must return", 20.0)
            assert link.state().in_failsafe
