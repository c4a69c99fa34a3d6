"""VehicleLink when the link breaks, the vehicle restarts, or a second one appears under its system id."""

from __future__ import annotations

import re
from collections.abc import AsyncIterator, Iterator
from contextlib import suppress

import pytest

from app.domain.errors import ConflictError, LinkTimeoutError, VehicleQuarantinedError
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.vehicle.facts import (
    DuplicateSystem,
    LinkLost,
    LinkRestored,
    QuarantineEnded,
    Rebooted,
    SentInQuarantine,
    StatusText,
)
from app.domain.vehicle.link_security import RefusalKind
from app.domain.vehicle.state import FlightMode, GnssFix, VehicleType
from app.vehicles.settings import LinkSettings
from tests.support.driving import ReceivedFacts, flying, mission, opened, opened_link, started, until, uploaded
from tests.support.simulated import SimulatedFleet


@pytest.fixture
def own_quad() -> Iterator[SimulatedFleet]:
    """A vehicle for one test, as these change it for good."""
    with SimulatedFleet("quad", speed=3.0) as fleet:
        yield fleet


@pytest.fixture
async def own_link(own_quad: SimulatedFleet) -> AsyncIterator[VehicleLink]:
    async with opened_link(own_quad.connections) as found:
        yield found


async def test_a_cut_link_is_lost_after_three_seconds_and_restored_with_the_next_heartbeat(
    own_quad: SimulatedFleet, own_link: VehicleLink
) -> None:
    received = ReceivedFacts(own_link)
    await until(lambda: own_link.state().latitude_deg is not None, "a position must come", 15.0)
    place = own_link.state().latitude_deg
    own_quad.control("link_cut", True)
    lost = await received.until(LinkLost, 15.0)
    assert 3.0 < lost.heartbeat_age_s < 10.0
    assert own_link.state().connected is False
    assert own_link.state().latitude_deg == place, "what was last known stays readable"
    assert (own_link.state().position_age_s or 0.0) > 2.5
    with pytest.raises(LinkTimeoutError):
        await own_link.hold()
    own_quad.control("link_cut", False)
    await received.until(LinkRestored, 15.0)
    assert own_link.state().connected is True
    assert len(received.of(LinkLost)) == 1
    await own_link.hold()


async def test_a_restart_is_told_and_facts_are_read_again(own_quad: SimulatedFleet, own_link: VehicleLink) -> None:
    received = ReceivedFacts(own_link)
    booted = "its clock must be further on than datagrams that overtake each other explain"
    await until(lambda: (own_link.state().boot_time_s or 0.0) > 4.0, booted, 10.0)
    first = await own_link.read_facts()
    assert await own_link.read_facts() == first
    uid = own_link.identity.uid
    own_quad.control("reboot", True)
    await received.until(Rebooted, 10.0)
    again = await own_link.read_facts()
    assert again.parameters.keys() == first.parameters.keys()
    assert own_link.identity.uid == uid
    assert not received.of(DuplicateSystem)
    assert len(received.of(Rebooted)) == 1


async def test_after_a_restart_in_flight_the_kept_mission_starts_at_its_first_item(
    own_quad: SimulatedFleet, own_link: VehicleLink
) -> None:
    received = ReceivedFacts(own_link)
    await flying(own_link, mission(6, north_m=40))
    await own_link.set_current(3)
    await until(lambda: own_link.state().mission_seq == 3, "item 3 must be current", 15.0)
    own_quad.control("reboot", True)
    await received.until(Rebooted, 10.0)
    await until(lambda: own_link.state().mission_seq == 0, "the index must be 0 again", 15.0)
    await own_link.wait_mission_ready(mission_id=own_link.state().mission_id, rerun=True, timeout_s=10.0)


async def test_a_second_vehicle_that_appears_later_on_an_open_link_is_noticed_and_nothing_more_is_sent(
    own_quad: SimulatedFleet,
) -> None:
    async with opened_link([f"{url}?peer=any" for url in own_quad.connections]) as link:
        received = ReceivedFacts(link)
        await uploaded(link, mission(3))
        assert not received.of(DuplicateSystem)
        own_quad.control("duplicate_sysid", True)
        await received.until(DuplicateSystem, 10.0)
        with pytest.raises(VehicleQuarantinedError):
            await link.start_mission()


async def test_a_quarantined_vehicle_obeys_hold_return_and_land_and_nothing_else(own_quad: SimulatedFleet) -> None:
    async with opened_link([f"{url}?peer=any" for url in own_quad.connections]) as link:
        received = ReceivedFacts(link)
        await flying(link, mission(4, north_m=40))
        own_quad.control("duplicate_sysid", True)
        await received.until(DuplicateSystem, 20.0)
        for command, mode in (
            (link.hold, FlightMode.HOLD),
            (link.return_to_launch, FlightMode.RETURN),
            (link.land, FlightMode.LAND),
        ):
            await command()
            assert received.of(SentInQuarantine)[-1] == SentInQuarantine(mode)
        for refused in (link.start_mission, link.disarm, link.arm, lambda: uploaded(link, mission(3))):
            with pytest.raises(VehicleQuarantinedError):
                await refused()


async def test_a_quarantine_ends_when_one_vehicle_was_alone_for_a_while(own_quad: SimulatedFleet) -> None:
    soon = LinkSettings(quarantine_s=3.0)
    async with opened_link([f"{url}?peer=any" for url in own_quad.connections], settings=soon) as link:
        received = ReceivedFacts(link)
        own_quad.control("duplicate_sysid", True)
        await received.until(DuplicateSystem, 20.0)
        own_quad.control("duplicate_sysid", False)
        assert (await received.until(QuarantineEnded, 30.0)).actor is None
        await uploaded(link, mission(3))


async def test_a_quarantine_that_a_user_ends_begins_again_with_the_next_sign_of_a_second_vehicle(
    own_quad: SimulatedFleet,
) -> None:
    async with opened_link([f"{url}?peer=any" for url in own_quad.connections]) as link:
        received = ReceivedFacts(link)
        with pytest.raises(ConflictError):
            link.end_quarantine("anna")
        own_quad.control("duplicate_sysid", True)
        await received.until(DuplicateSystem, 20.0)
        link.end_quarantine("anna")
        assert received.of(QuarantineEnded) == [QuarantineEnded("anna")]
        await until(lambda: len(received.of(DuplicateSystem)) == 2, "the second vehicle is still there", 20.0)


async def test_a_second_vehicle_that_appears_later_on_a_pinned_link_is_not_heard(own_quad: SimulatedFleet) -> None:
    async with opened(own_quad.connections, vehicles=1) as source:
        link = source.links()[0]
        received = ReceivedFacts(link)
        own_quad.control("duplicate_sysid", True)
        await until(
            lambda: any(refused.kind is RefusalKind.OTHER_PEER for refused in source.refused()),
            "the second one must be refused",
            10.0,
        )
        await uploaded(link, mission(3))
        assert not received.of(DuplicateSystem)


async def test_datagrams_that_overtake_each_other_are_no_restart_and_no_second_vehicle(
    own_quad: SimulatedFleet, own_link: VehicleLink
) -> None:
    received = ReceivedFacts(own_link)
    last = await uploaded(own_link, mission(5, north_m=30))  # before: mavsdk gives up every other upload on such a link
    for fault, value in {"jitter_s": 0.3, "reorder": 0.3, "duplicate": 0.3}.items():
        own_quad.control(fault, value)
    await started(own_link, last)
    own_quad.control("loss", 0.1)  # not before: arming is asked for once, and its answer may be lost
    for _ in range(5):  # with losses one command in a hundred goes unanswered, and says so
        with suppress(LinkTimeoutError):
            await own_link.return_to_launch()
            break
    await until(lambda: own_link.state().mode is FlightMode.RETURN, "it must return", 20.0)
    assert not received.of(DuplicateSystem)
    assert not received.of(Rebooted)


async def test_long_texts_are_joined(own_quad: SimulatedFleet, own_link: VehicleLink) -> None:
    received = ReceivedFacts(own_link)
    await flying(own_link, mission(4, north_m=30))
    await own_link.return_to_launch()
    long = re.compile(r"RTL: start return at \d+ m \(\d+ m above destination\)")
    await until(
        lambda: any(long.fullmatch(fact.text) for fact in received.of(StatusText)),
        "a text of more than 50 characters must come whole",
        5.0,
    )


async def test_each_airframe_is_known_for_what_it_is() -> None:
    with SimulatedFleet("quad,plane,vtol,rover", speed=3.0, shared_port=True) as fleet:
        async with opened(fleet.connections, vehicles=4) as source:
            kinds = {link.identity.system_id: link.identity.vehicle_type for link in source.links()}
    assert kinds == {
        1: VehicleType.MULTICOPTER,
        2: VehicleType.FIXED_WING,
        3: VehicleType.VTOL,
        4: VehicleType.ROVER,
    }


async def test_facts_hold_what_rules_need(own_link: VehicleLink) -> None:
    facts = await own_link.read_facts()
    assert facts.vehicle_type is VehicleType.MULTICOPTER
    assert facts.home is not None
    assert facts.home.altitude_m == pytest.approx(488.0, abs=2.0)
    assert facts.parameters["NAV_ACC_RAD"] == 10.0
    assert isinstance(facts.parameters["MIS_TKO_LAND_REQ"], int)
    assert "PWM_AUX_FUNC1" not in facts.parameters, "a parameter that does not exist is absent"


async def test_a_negative_integer_parameter_is_read_exactly() -> None:
    with SimulatedFleet("quad", speed=3.0, params="PD_GRIPPER_TYPE=-1") as fleet:
        async with opened_link(fleet.connections) as link:
            facts = await link.read_facts()
            assert facts.parameters["PD_GRIPPER_TYPE"] == -1


async def test_the_position_comes_with_how_good_it_is(own_link: VehicleLink, own_quad: SimulatedFleet) -> None:
    await until(lambda: own_link.state().gnss_fix is GnssFix.FIX_3D, "GPS_RAW_INT must come", 15.0)
    assert own_link.state().gnss_satellites == 10
    assert own_link.state().gnss_hdop == pytest.approx(0.7)
    own_quad.control("gps_loss", True)
    await until(lambda: own_link.state().gnss_fix is GnssFix.NO_GPS, "its loss must show", 15.0)
