"""A circle that is flown outside: from tick to tick the aim moves inwards, and another task begins anew."""

from __future__ import annotations

from app.domain.offboard.messages import LocalTarget
from tests.support.controlled_vehicle import ControlledVehicle, controlled_vehicle
from tests.support.queued_tasks import flying, put_at, queue


def north_m_s(quad: ControlledVehicle) -> float:
    """Of the newest setpoint."""
    newest = quad.sent[-1]
    assert isinstance(newest, LocalTarget)
    return newest.velocity[0]


async def held_outside(quad: ControlledVehicle, seconds: int) -> float:
    """A metre north of the circle, whatever it is told; the velocity to the north that it is told then."""
    for _ in range(seconds * 10):
        put_at(quad, 21.0, 0.0, velocity_north_m_s=0.0, velocity_east_m_s=0.0)
        quad.clock.time_s += 0.1
        quad.control.require(quad.lease)
        await quad.ticks(1)
    return north_m_s(quad)


async def test_the_aim_moves_inwards_while_it_flies_outside_and_a_new_circle_begins_without() -> None:
    async with controlled_vehicle() as quad:
        circle = {"center": {"north_m": 0.0, "east_m": 0.0}, "radius_m": 20.0, "speed_m_s": 5.0}
        await flying(quad, "circle", **circle)
        first = await held_outside(quad, 1)
        assert first < 0.0, "back to the circle"
        later = await held_outside(quad, 3)
        assert later < first - 0.5
        queue(quad, "circle", "replace_all", **circle)
        assert await held_outside(quad, 1) > later + 0.5
