"""A plan becomes a mission: every plan item in order, numbered, with the map back from seq to plan item."""

from __future__ import annotations

from app.domain.compiler.detour_items import add_detour
from app.domain.compiler.draft import DraftList
from app.domain.compiler.drop_items import PAUSE_S, add_drop, add_waypoint_with_drop, brakes_at_waypoint
from app.domain.compiler.fence_items import fence_items, rally_items
from app.domain.errors import PlanRejectedError
from app.domain.items import Stop
from app.domain.items.base import Site
from app.domain.items.change_speed import speed_drafts
from app.domain.items.delay import delay_draft
from app.domain.mission import CompiledDrop, Mission
from app.domain.plan.detour import alternate_drop
from app.domain.plan.document import Plan
from app.domain.plan.drops import DropUse, drops_of
from app.domain.plan.walk import Step, reference_home, walk
from app.domain.speeds import speeds_along
from app.domain.vehicle import GlobalPosition, VehicleFacts, VehicleType


def compile_plan(plan: Plan, facts: VehicleFacts) -> Mission:
    """The MISSION_ITEM_INT lists of a plan that passed the rules, for a vehicle with these facts.

    Raises PlanRejectedError for what has no items at all: a vehicle of another type, a drop at no position, a jump to
    nowhere, loiter turns. Everything else is left to the rules.
    """
    if facts.vehicle_type is not plan.vehicle_type:
        raise PlanRejectedError(f"the plan is for a {plan.vehicle_type}, the vehicle is a {facts.vehicle_type}")
    home = reference_home(plan, facts)
    steps = walk(plan, home, in_flight=facts.in_flight)
    drops = {drop.step.index: drop for drop in drops_of(steps)}
    braking = {
        drop.anchor.index: drop for drop in drops.values() if drop.anchor is not None and brakes_at_waypoint(drop)
    }
    drafts = DraftList()
    compiled: list[CompiledDrop] = []
    speeds = speeds_along(plan, facts, steps)
    for step, speed_m_s in zip(steps, speeds, strict=True):
        _add_cruise_speed(drafts, plan, step, facts)
        if step.index in drops:
            compiled += _add_drop(drafts, drops[step.index], home, facts, speed_m_s)
        elif step.index in braking:
            _add_braking_waypoint(drafts, step, braking[step.index], plan.vehicle_type)
        else:
            for draft in step.item.drafts(Site(step.start, step.end, home, facts)):
                drafts.add(step.item.id, draft)
            _add_cruise_speed_after_takeoff(drafts, plan, step)
    _end_with_no_release(drafts, compiled)
    return Mission(
        items=drafts.number(),
        fence=fence_items(plan.geofence),
        rally=rally_items(plan.rally_points),
        plan_item_of=drafts.plan_item_of(),
        drops=tuple(compiled),
    )


def _add_drop(
    drafts: DraftList, drop: DropUse, home: GlobalPosition, facts: VehicleFacts, speed_m_s: float
) -> list[CompiledDrop]:
    """The drop, with its alternate; nothing if it lets no parcel go."""
    added = add_drop(drafts, drop, facts, speed_m_s)
    there = alternate_drop(drop, home)
    if there is not None:
        added = add_detour(drafts, added, there, facts, speed_m_s)
    return [added] if drop.releases else []


def _add_braking_waypoint(drafts: DraftList, step: Step, drop: DropUse, vehicle_type: VehicleType) -> None:
    assert isinstance(step.item, Stop), "only a stop brakes for a drop"
    for draft in speed_drafts(step.item.asked_speed_m_s(), vehicle_type):
        drafts.add(step.item.id, draft)
    add_waypoint_with_drop(drafts, step.item, drop)


def _add_cruise_speed(drafts: DraftList, plan: Plan, step: Step, facts: VehicleFacts) -> None:
    """A rover never takes off, and a vehicle in flight has: their speed is set first of all."""
    if step.index != 0:
        return
    speed_m_s = plan.cruise_speed_m_s if plan.vehicle_type is VehicleType.ROVER else None
    if facts.in_flight is not None:
        speed_m_s = facts.in_flight.asked_speed_m_s
    for draft in speed_drafts(speed_m_s, plan.vehicle_type):
        drafts.add(step.item.id, draft)


def _add_cruise_speed_after_takeoff(drafts: DraftList, plan: Plan, step: Step) -> None:
    """After the takeoff, because PX4 sets the speed for the way in which it flies at that moment."""
    if step.item.takes_off and plan.vehicle_type is not VehicleType.ROVER:
        for draft in speed_drafts(plan.cruise_speed_m_s, plan.vehicle_type):
            drafts.add(step.item.id, draft)


def _end_with_no_release(drafts: DraftList, compiled: list[CompiledDrop]) -> None:
    """The item after a drop must exist: a supervised run moves the mission on to it."""
    if compiled and compiled[-1].resume_seq == drafts.next_seq:
        drafts.add(compiled[-1].plan_item_id, delay_draft(PAUSE_S))
