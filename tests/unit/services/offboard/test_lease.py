"""The lease: one holder, expiry, override, hand-over; a setpoint only from its holder."""

from __future__ import annotations

import pytest

from app.domain.cluster.lease import Leaseholder, SiteClaim, SiteTakenError
from app.domain.errors import LeaseHeldError, LeaseLostError, OffboardNotReadyError, VehicleQuarantinedError
from app.domain.offboard.state import OffboardState
from app.domain.ports.vehicle_link import VehicleIdentity
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.facts import DuplicateSystem
from tests.support.controlled_vehicle import controlled_vehicle
from tests.support.reasons import some
from tests.support.setpoint_examples import example


async def test_a_second_client_is_told_who_has_it_and_for_how_long() -> None:
    async with controlled_vehicle() as quad:
        quad.take("ann")
        with pytest.raises(LeaseHeldError, match="ann") as held:
            quad.control.acquire("ben", rate_hz=20.0)
        assert held.value.extra == {"holder": "ann", "expires_in_s": 10.0}
        with pytest.raises(LeaseHeldError):
            quad.control.acquire("ann", rate_hz=20.0)  # the same person at another place is another client


async def test_nobody_takes_or_enters_control_while_another_gateway_has_the_site() -> None:
    other = SiteClaim.taken(Leaseholder(gateway="gw-2", address="elsewhere"))
    async with controlled_vehicle() as quad:
        quad.take("ann")
        quad.put()
        quad.fleet.gate_new_work(lambda: other.why_no_new_work("north"))
        with pytest.raises(SiteTakenError):
            await quad.enter()
        assert quad.vehicle.sent == [], "the vehicle is left as it is"
        quad.control.release(quad.lease, some("done"))
        with pytest.raises(SiteTakenError):
            quad.take("ann")


async def test_control_that_began_before_goes_on_and_ends_in_hold() -> None:
    other = SiteClaim.taken(Leaseholder(gateway="gw-2", address="elsewhere"))
    async with controlled_vehicle() as quad:
        await quad.flown()
        quad.fleet.gate_new_work(lambda: other.why_no_new_work("north"))
        quad.put()
        await quad.ticks(2)
        quad.control.release(quad.lease, some("done"))
        await quad.until(lambda: quad.vehicle.sent[-1:] == ["hold"], "it holds")


async def test_an_unused_lease_expires_and_a_used_one_does_not() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        quad.clock.time_s += 9.0
        quad.control.require(quad.lease)
        quad.clock.time_s += 9.0
        assert quad.control.require(quad.lease)
        quad.clock.time_s += 10.0
        await quad.until_state(OffboardState.IDLE)
        assert (await quad.recorded("offboard.lease"))[-1]["change"] == "expired"
        quad.take("ben")


async def test_who_comes_as_a_lease_expires_takes_no_flight_over() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        quad.clock.time_s += 10.0
        quad.take("ben")  # before the tick that would have noticed
        assert quad.control.state is OffboardState.LEASED
        await quad.until(lambda: quad.vehicle.sent[-1] == "hold", "what ann flew must hold")
        assert [lease["change"] for lease in await quad.recorded("offboard.lease")] == [
            "acquired",
            "expired",
            "acquired",
        ]


async def test_a_released_lease_is_free_and_its_id_worthless() -> None:
    async with controlled_vehicle() as quad:
        old = quad.take("ann")
        quad.control.release(old, some("done"))
        quad.take("ben")
        for use in (quad.control.require, lambda lease: quad.control.release(lease, None)):
            with pytest.raises(LeaseLostError):
                use(old)
        assert quad.control.lease is not None


async def test_an_override_takes_it_and_the_old_holder_can_send_nothing() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        old = quad.lease
        quad.take("admin", override=True)
        assert quad.control.state is OffboardState.ACTIVE, "the vehicle stays under control"
        with pytest.raises(LeaseLostError):
            quad.control.put(old, example("velocity_ned"))
        changes = [lease["change"] for lease in await quad.recorded("offboard.lease")]
        assert changes == ["acquired", "overridden"]


async def test_a_hand_over_goes_to_the_one_it_was_offered_to_alone() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        old = quad.lease
        quad.control.offer(old, "ben")
        with pytest.raises(LeaseHeldError):
            quad.control.acquire("eve", rate_hz=20.0)
        quad.take("ben")
        with pytest.raises(LeaseLostError):
            quad.control.require(old)
        sent = quad.control.view().lease
        assert sent is not None
        assert (sent.holder, sent.offered_to) == ("ben", None)


async def test_a_new_holder_who_says_nothing_is_a_silent_client() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        quad.control.offer(quad.lease, "ben")
        quad.take("ben")
        await quad.silent_for(1.2)
        await quad.until(lambda: quad.vehicle.sent[-1] == "hold", "Hold must be commanded")


async def test_a_quarantined_or_unknown_vehicle_has_no_lease() -> None:
    async with controlled_vehicle() as quad:
        quad.vehicle.put(DuplicateSystem(Reason.of(ReasonCode.TWO_CLOCKS)))
        with pytest.raises(VehicleQuarantinedError):
            quad.take()
    async with controlled_vehicle() as quad:
        quad.vehicle.identity = VehicleIdentity(1, "udpin://scripted")
        with pytest.raises(OffboardNotReadyError):
            quad.take()


async def test_the_secret_of_a_lease_is_nowhere_shown() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        shown = quad.control.view().model_dump_json() + str(quad.events.events)
        assert quad.lease not in shown
