"""Where a drop's waypoint should be so that the vehicle waits there when the target comes, or why nowhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.domain.geo import LocalProjection, distance_m
from app.domain.items.fields import Point
from app.domain.items.target import Target
from app.domain.moving_target.intercept import intercept_s
from app.domain.moving_target.report import TargetFix
from app.domain.reason import Reason, ReasonCode, because

SETTLE_S: Final = 4.0
"""The vehicle is there so much before the target: it brakes, comes to rest, is looked at."""
LONGEST_AHEAD_S: Final = 600.0
"""No target is foretold farther than this."""


@dataclass(frozen=True, slots=True)
class Aim:
    """The place for the waypoint. `after_s`: when the target is there. `moved_m`: from the planned point."""

    latitude_deg: float
    longitude_deg: float
    after_s: float
    moved_m: float


@dataclass(frozen=True, slots=True)
class NoAim:
    """The waypoint stays where it is."""

    reason: Reason


def aim(
    target: Target, planned: Point, fix: TargetFix | None, vehicle: tuple[float, float], speed_m_s: float
) -> Aim | NoAim:
    """The intercept point for a vehicle (latitude, longitude in degrees) that flies straight there at a speed.

    Law: never farther than `target.max_move_m` from `planned`.
    """
    if fix is None:
        return NoAim(because(ReasonCode.FEED_SILENT, feed=target.feed))
    if fix.is_stale:
        return NoAim(because(ReasonCode.FEED_STALE, feed=target.feed, age_s=fix.age_s))
    if fix.report.speed_m_s > target.max_speed_m_s:
        speeds = {"speed_m_s": fix.report.speed_m_s, "max_speed_m_s": target.max_speed_m_s}
        return NoAim(because(ReasonCode.FEED_TOO_FAST, **speeds))
    east_m, north_m = LocalProjection(*vehicle).to_local(*fix.place(SETTLE_S))
    flown_s = intercept_s(north_m, east_m, fix.report.north_m_s, fix.report.east_m_s, speed_m_s)
    if flown_s is None or flown_s > LONGEST_AHEAD_S:
        return NoAim(because(ReasonCode.FEED_UNREACHABLE, speed_m_s=speed_m_s))
    latitude_deg, longitude_deg = fix.place(flown_s + SETTLE_S)
    moved_m = distance_m(planned.latitude_deg, planned.longitude_deg, latitude_deg, longitude_deg)
    if moved_m > target.max_move_m:
        return NoAim(because(ReasonCode.FEED_OUT_OF_BOUNDS, moved_m=moved_m, max_move_m=target.max_move_m))
    return Aim(latitude_deg, longitude_deg, flown_s + SETTLE_S, moved_m)
