"""A commanded wing that a failsafe, a pilot or an operator has: nothing that was meant before takes it from them."""

from __future__ import annotations

from app.domain.vehicle import FlightMode
from tests.unit.services.tasks.commanded import FAR, flying, gone_on, plane
from tests.unit.services.tasks.queued import report


async def test_a_failsafe_that_waits_in_hold_ends_the_lease_and_is_left_alone() -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        wing.vehicle.put(in_failsafe=True, mode=FlightMode.HOLD)
        assert wing.control.lease is None
        assert "failsafe" in report(wing).reason
        await gone_on(wing, 0.9)
        assert len(wing.vehicle.orders) == 1, "an order would end what PX4 is about to do"
