"""Intercepts of moving targets, and the plan that results from one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from app.domain.geo import LocalProjection, distance_m
from app.domain.items import Gripper, Waypoint
from app.domain.items.drop_places import Target
from app.domain.items.fields import Point
from app.domain.plan.document import Plan
from app.domain.plan.walk import reference_home, speeds_along, walk
from app.domain.reasons import Reason, ReasonCode
from app.domain.targets import TargetFix
from app.domain.vehicle.state import VehicleProfile

MET_M: Final = 1e-6
"""A target so near is met. The squares of much smaller distances are 0 in floating point."""


def intercept_s(north_m: float, east_m: float, north_m_s: float, east_m_s: float, speed_m_s: float) -> float | None:
    """Return the seconds until the first intercept of a target with constant velocity, None if there is none.

    The target is at (`north_m`, `east_m`) from the vehicle. |p + v t| = s t is a quadratic in t. Its roots are computed
    in the numerically stable form (q = -(b + sign(b) sqrt(d)) / 2).
    """
    if math.hypot(north_m, east_m) < MET_M:
        return 0.0
    c = north_m**2 + east_m**2
    a = north_m_s**2 + east_m_s**2 - speed_m_s**2
    b = 2.0 * (north_m * north_m_s + east_m * east_m_s)
    discriminant = b**2 - 4.0 * a * c
    if discriminant < 0.0:
        return None
    q = -(b + math.copysign(math.sqrt(discriminant), b)) / 2.0
    roots = [q / a if a != 0.0 else math.inf, c / q if q != 0.0 else math.inf]
    return min((root for root in roots if 0.0 < root < math.inf), default=None)


SETTLE_S: Final = 4.0
"""How long before the target the vehicle arrives, to brake, come to rest and be checked."""
LONGEST_AHEAD_S: Final = 600.0
"""Targets are not extrapolated farther than this."""


@dataclass(frozen=True, slots=True)
class Aim:
    """A position of the waypoint. `after_s`: when the target arrives. `moved_m`: distance from the planned point."""

    latitude_deg: float
    longitude_deg: float
    after_s: float
    moved_m: float


@dataclass(frozen=True, slots=True)
class NoAim:
    """The waypoint stays where it is, for this reason."""

    reason: Reason


def aim(
    target: Target, planned: Point, fix: TargetFix | None, vehicle: tuple[float, float], speed_m_s: float
) -> Aim | NoAim:
    """Return the intercept for a vehicle (latitude, longitude in degrees) that flies straight to it at a speed.

    Law: never farther than `target.max_move_m` from `planned`.
    """
    if fix is None:
        return NoAim(Reason.of(ReasonCode.FEED_SILENT, feed=target.feed))
    if fix.is_stale:
        return NoAim(Reason.of(ReasonCode.FEED_STALE, feed=target.feed, age_s=fix.age_s))
    if fix.report.speed_m_s > target.max_speed_m_s:
        speeds = {"speed_m_s": fix.report.speed_m_s, "max_speed_m_s": target.max_speed_m_s}
        return NoAim(Reason.of(ReasonCode.FEED_TOO_FAST, **speeds))
    east_m, north_m = LocalProjection(*vehicle).to_local(*fix.place(SETTLE_S))
    flown_s = intercept_s(north_m, east_m, fix.report.north_m_s, fix.report.east_m_s, speed_m_s)
    if flown_s is None or flown_s > LONGEST_AHEAD_S:
        return NoAim(Reason.of(ReasonCode.FEED_UNREACHABLE, speed_m_s=speed_m_s))
    latitude_deg, longitude_deg = fix.place(flown_s + SETTLE_S)
    moved_m = distance_m(planned.latitude_deg, planned.longitude_deg, latitude_deg, longitude_deg)
    if moved_m > target.max_move_m:
        return NoAim(Reason.of(ReasonCode.FEED_OUT_OF_BOUNDS, moved_m=moved_m, max_move_m=target.max_move_m))
    return Aim(latitude_deg, longitude_deg, flown_s + SETTLE_S, moved_m)


@dataclass(frozen=True, slots=True)
class FollowingDrop:
    """A waypoint that follows a target, and its drop."""

    waypoint: Waypoint
    drop: Gripper
    target: Target

    @property
    def planned(self) -> Point:
        """The point around which it may move."""
        own = Point(latitude_deg=self.waypoint.latitude_deg, longitude_deg=self.waypoint.longitude_deg)
        return self.target.planned or own

    def distance_m(self, latitude_deg: float, longitude_deg: float) -> float:
        """The current position of the waypoint."""
        return distance_m(self.waypoint.latitude_deg, self.waypoint.longitude_deg, latitude_deg, longitude_deg)


def follower_at(plan: Plan, item_id: str | None) -> FollowingDrop | None:
    """Return the follower whose waypoint is this item, or None."""
    index = None if item_id is None else plan.index_of(item_id)
    waypoint = None if index is None else plan.items[index]
    if index is None or not isinstance(waypoint, Waypoint):
        return None
    for item in plan.items[index + 1 :]:
        if isinstance(item, Gripper) and item.target is not None:
            return FollowingDrop(waypoint, item, item.target)
        if not item.stays:
            return None
    return None


def moved(plan: Plan, follower: FollowingDrop, latitude_deg: float, longitude_deg: float) -> Plan:
    """Return the plan with the follower's waypoint moved. The planned point is kept."""
    place = {"latitude_deg": latitude_deg, "longitude_deg": longitude_deg}
    target = follower.target.model_copy(update={"planned": follower.planned})
    changed = {
        follower.waypoint.id: follower.waypoint.model_copy(update=place),
        follower.drop.id: follower.drop.model_copy(update={"target": target}),
    }
    return plan.model_copy(update={"items": tuple(changed.get(item.id, item) for item in plan.items)})


def approach_speeds_m_s(plan: Plan, facts: VehicleProfile) -> Mapping[str, float]:
    """Return the ground speed in m/s in calm air at which each waypoint that follows a target is flown to, by id."""
    if not any(item.followed() for item in plan.items):
        return {}
    speeds = speeds_along(plan, facts, walk(plan, reference_home(plan, facts)))
    return {
        item.id: speed_m_s
        for item, speed_m_s in zip(plan.items, speeds, strict=True)
        if follower_at(plan, item.id) is not None
    }
