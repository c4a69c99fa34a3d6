"""Rules for drops at moving targets: every position that the target may lead to must be allowed before takeoff."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from app.domain.autopilot import Quantity
from app.domain.geo import LatLon, distance_m
from app.domain.items.drop_places import Target
from app.domain.items.fields import Point
from app.domain.plan.drops import DropUse
from app.domain.plan.walk import Step
from app.domain.prediction.ground_paths import point_of
from app.domain.rules.registry import RuleContext, RuleSet, Violation, at_item
from app.domain.vehicle.state import FlightRegime

rules = RuleSet()
_OURS: Final = "Waydrop."

_ROUNDING_M: Final = 0.05
"""Coordinates on the wire are 1e-7 degrees."""
_AROUND: Final = 1.001
"""The polygon of a circle lies inside the true circle by less than this."""

Following = tuple[DropUse, Target, Step]


def _following(context: RuleContext) -> Iterator[Following]:
    """Return the drops that follow a target, with the target and the waypoint's step."""
    for drop in context.drops:
        if (target := drop.item.followed()) is not None and drop.anchor is not None:
            yield drop, target, drop.anchor


@rules.error(
    "target.cannot_follow",
    "The vehicle waits at a position for the target, and Waydrop checks whether the target is there.",
    _OURS,
)
def _cannot_follow(context: RuleContext) -> Iterator[Violation]:
    for drop in context.drops:
        if drop.item.followed() is None:
            continue
        anchor = None if drop.anchor is None else drop.anchor.item
        if not drop.supervised or not drop.releases:
            message = "only a supervised release can follow a target"
        elif not drop.stopped or drop.carried is not FlightRegime.ROTARY_WING or anchor is None or not anchor.holds():
            message = "only a rotary wing that stops at a waypoint can wait for a target"
        else:
            continue
        hint = 'use a multicopter or a hovering VTOL, a waypoint, "release_motion": "stopped" and a supervised release'
        yield at_item(drop.step, message, hint, "target")


@rules.error("target.shared", "All drops at a waypoint move with it, but only one of them checks the target.", _OURS)
def _shared(context: RuleContext) -> Iterator[Violation]:
    for drop, _, anchor in _following(context):
        if any(other.anchor == anchor and other.step.index != drop.step.index for other in context.drops):
            message = f"another drop uses the waypoint {anchor.item.id}, which follows the target"
            yield at_item(drop.step, message, "add a separate waypoint for the other drop", "target")


@rules.error(
    "target.in_loop",
    "A waypoint inside a loop cannot be moved in flight, because the count of the loop would be lost.",
    _OURS,
)
def _in_loop(context: RuleContext) -> Iterator[Violation]:
    for drop, _, anchor in _following(context):
        for step in context.steps:
            back_to = step.item.jumps_to()
            begin = None if back_to is None else context.plan.index_of(back_to)
            if begin is not None and begin <= anchor.index < step.index:
                message = f"the jump {step.item.id} returns to the target's waypoint"
                yield at_item(drop.step, message, "move the drop out of the loop", "target")
                break


@rules.error(
    "target.outside_fence",
    "The target may lead the vehicle anywhere within max_move_m of the planned point. All of it must be allowed.",
    _OURS,
)
def _outside(context: RuleContext) -> Iterator[Violation]:
    for drop, target, anchor in _following(context):
        planned = _planned(target, anchor)
        centre = point_of(LatLon(planned.latitude_deg, planned.longitude_deg, 0.0), context.projection)
        disc = centre.buffer(target.max_move_m * _AROUND, quad_segs=32)
        if context.fence is not None and not context.fence.allows(disc):
            message = f"the geofence excludes part of the area within {target.max_move_m:g} m of the planned point"
            yield at_item(drop.step, message, "reduce max_move_m, or change the geofence", "target", "max_move_m")


@rules.error(
    "target.too_far",
    "The target may lead the vehicle max_move_m farther away than planned.",
    "`limits` of the plan; PX4 GF_MAX_HOR_DIST.",
)
def _too_far(context: RuleContext) -> Iterator[Violation]:
    own_m = context.plan.limits.max_distance_m
    for drop, target, anchor in _following(context):
        planned, home = _planned(target, anchor), context.home
        away_m = distance_m(home.latitude_deg, home.longitude_deg, planned.latitude_deg, planned.longitude_deg)
        farthest_m = away_m + target.max_move_m
        most_m = own_m
        if most_m is None or farthest_m <= most_m:
            most_m = context.behaviour.quantity(Quantity.FARTHEST_M)
        if 0 < most_m < farthest_m:
            message = f"the target may lead to {farthest_m:.0f} m from home; the limit is {most_m:g} m"
            name = context.behaviour.name_of(Quantity.FARTHEST_M)
            hint = f"reduce max_move_m, or raise limits.max_distance_m and {name}"
            yield at_item(drop.step, message, hint, "target", "max_move_m")


@rules.error(
    "target.moved_too_far", "A waypoint that follows a target must stay within max_move_m of the planned point.", _OURS
)
def _moved_too_far(context: RuleContext) -> Iterator[Violation]:
    for drop, target, anchor in _following(context):
        planned, now = _planned(target, anchor), anchor.end
        moved_m = distance_m(planned.latitude_deg, planned.longitude_deg, now.latitude_deg, now.longitude_deg)
        if moved_m > target.max_move_m + _ROUNDING_M:
            message = f"the waypoint is {moved_m:.0f} m from the planned point; the limit is {target.max_move_m:g} m"
            yield at_item(drop.step, message, "remove planned: it defaults to the waypoint", "target", "planned")


@rules.error("target.not_caught", "A vehicle that is not faster than its target may never reach it.", _OURS)
def _not_caught(context: RuleContext) -> Iterator[Violation]:
    for drop, target, anchor in _following(context):
        speed_m_s = context.speeds_m_s[anchor.index]
        if anchor.after is FlightRegime.ROTARY_WING and target.max_speed_m_s >= speed_m_s:
            message = f"the target may move as fast as the vehicle, which flies there at {speed_m_s:g} m/s"
            hint = "increase speed_m_s of the waypoint, or reduce max_speed_m_s of the target"
            yield at_item(drop.step, message, hint, "target", "max_speed_m_s")


def _planned(target: Target, anchor: Step) -> Point:
    return target.planned or Point(latitude_deg=anchor.end.latitude_deg, longitude_deg=anchor.end.longitude_deg)
