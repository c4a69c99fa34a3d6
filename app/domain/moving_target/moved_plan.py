"""The drops of a plan that follow a target, and the plan with such a drop's waypoint at another place."""

from __future__ import annotations

from dataclasses import dataclass

from app.domain.geo import distance_m
from app.domain.items import Gripper, Waypoint
from app.domain.items.fields import Point
from app.domain.items.target import Target
from app.domain.plan.document import Plan
from app.domain.plan.walk import reference_home, walk
from app.domain.speeds import speeds_along
from app.domain.vehicle import VehicleFacts


@dataclass(frozen=True, slots=True)
class Follower:
    """A waypoint that follows a target, and the drop there."""

    waypoint: Waypoint
    drop: Gripper
    target: Target

    @property
    def planned(self) -> Point:
        """The point around which it may move."""
        own = Point(latitude_deg=self.waypoint.latitude_deg, longitude_deg=self.waypoint.longitude_deg)
        return self.target.planned or own

    def distance_m(self, latitude_deg: float, longitude_deg: float) -> float:
        """From where the waypoint is now."""
        return distance_m(self.waypoint.latitude_deg, self.waypoint.longitude_deg, latitude_deg, longitude_deg)


def follower_at(plan: Plan, item_id: str | None) -> Follower | None:
    """The follower whose waypoint is this item; None if there is none."""
    index = None if item_id is None else plan.index_of(item_id)
    waypoint = None if index is None else plan.items[index]
    if index is None or not isinstance(waypoint, Waypoint):
        return None
    for item in plan.items[index + 1 :]:
        if isinstance(item, Gripper) and item.target is not None:
            return Follower(waypoint, item, item.target)
        if not item.stays:
            return None
    return None


def moved(plan: Plan, follower: Follower, latitude_deg: float, longitude_deg: float) -> Plan:
    """The plan with the follower's waypoint at another place. Where it was planned stays known."""
    place = {"latitude_deg": latitude_deg, "longitude_deg": longitude_deg}
    target = follower.target.model_copy(update={"planned": follower.planned})
    changed = {
        follower.waypoint.id: follower.waypoint.model_copy(update=place),
        follower.drop.id: follower.drop.model_copy(update={"target": target}),
    }
    return plan.model_copy(update={"items": tuple(changed.get(item.id, item) for item in plan.items)})


def speed_towards_m_s(plan: Plan, facts: VehicleFacts, item_id: str) -> float:
    """Ground speed in m/s at which an item of the plan is flown to, without wind."""
    steps = walk(plan, reference_home(plan, facts))
    return speeds_along(plan, facts, steps)[plan.index_of(item_id) or 0]
