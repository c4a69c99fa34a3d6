"""Compiles a plan to numbered MISSION_ITEM_INTs, with a map from seq to plan item."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from app.domain.autopilot import Quantity, behaviour, quantity
from app.domain.errors import PlanRejectedError
from app.domain.items import Drop, Stop
from app.domain.items.base import Draft, Leg, command_draft, degrees_e7
from app.domain.items.change_speed import speed_drafts
from app.domain.items.delay import delay_draft
from app.domain.mission import NAN, CompiledDrop, MavCmd, MavFrame, Mission, MissionItem, MissionType
from app.domain.plan.document import Geofence, Plan, RallyPoint
from app.domain.plan.drops import LEAVE_S, DropUse, alternate_drop, drops_of
from app.domain.plan.walk import Step, reference_home, speeds_along, walk
from app.domain.vehicle.state import FlightRegime, GlobalPosition, VehicleProfile, VehicleType


@dataclass(slots=True)
class DraftList:
    """Items in flying order, each with its plan item."""

    drafts: list[Draft] = field(default_factory=list)
    owners: list[str] = field(default_factory=list)

    def add(self, owner: str, draft: Draft) -> int:
        """Append an item and return its seq."""
        self.drafts.append(draft)
        self.owners.append(owner)
        return len(self.drafts) - 1

    def last_seq_of(self, owner: str) -> int:
        """Return the seq of a plan item that was appended recently."""
        return next(seq for seq in range(len(self.owners) - 1, -1, -1) if self.owners[seq] == owner)

    @property
    def next_seq(self) -> int:
        return len(self.drafts)

    def number(self, seqs_of: Mapping[str, Sequence[int]]) -> tuple[MissionItem, ...]:
        """Return contiguous items. The first is current; jumps point to the first item of their target."""
        first = {item_id: seqs[0] for item_id, seqs in seqs_of.items()}
        return tuple([_numbered(seq, draft, first) for seq, draft in enumerate(self.drafts)])

    def seqs_of(self) -> Mapping[str, Sequence[int]]:
        """Return the sequence numbers of each plan item. Raises PlanRejectedError if a jump target has none."""
        found: dict[str, list[int]] = {}
        for seq, owner in enumerate(self.owners):
            found.setdefault(owner, []).append(seq)
        for draft in self.drafts:
            if draft.jump_to is not None and draft.jump_to not in found:
                raise PlanRejectedError(f"the jump target {draft.jump_to} is not a mission item")
        return found

    def plan_item_of(self) -> Mapping[int, str]:
        return dict(enumerate(self.owners))


def _numbered(seq: int, draft: Draft, first: Mapping[str, int]) -> MissionItem:
    param1 = draft.params[0]
    if draft.jump_to is not None:
        param1 = float(first[draft.jump_to])
    return MissionItem(
        seq,
        draft.frame,
        draft.command,
        param1,
        *draft.params[1:],
        x=draft.x,
        y=draft.y,
        z=draft.z,
        current=seq == 0,
    )


# Compiles drops: each expectation of the plan becomes items that have that effect on PX4.
#
# A stopped drop of a rotary wing: hold and acceptance radius together, at the waypoint (the gripper item itself does
# not brake on current firmware). A loiter ends at the vehicle's own radius, still moving: a waypoint follows it.
# On the ground and on wheels: NAV_DELAY. A moving drop: no hold.


STOP_RADIUS_M = 1.0
"""Acceptance radius of a stop. Flown: 1 m with a hold stops 0.9 m away at 0.1 m/s; the default 10 m does not stop."""
EMBEDDED_HOLD_S = 5.0
"""Hold before an embedded release. With a radius of 1 m it is enough to come to rest (flown with 5 s)."""
PAUSE_S = 1.0
"""Delay between two drops at one position, and after a drop at the end: an item that is not a release must follow."""


def add_waypoint_with_drop(drafts: DraftList, item: Stop, drop: DropUse) -> None:
    """The waypoint of a stopped drop of a rotary wing: it brakes there and waits."""
    if brakes_to_prepare(drop):
        hold_s = max(PAUSE_S, item.hovers_s())
    else:
        hold_s = drop.item.hold_s if drop.supervised else EMBEDDED_HOLD_S
        hold_s = max(hold_s, item.hovers_s()) + _leave_s(drop)
    drafts.add(item.id, item.waypoint_draft(hold_s, stop_radius_m(item.reach_m())))


def add_drop(drafts: DraftList, drop: DropUse, facts: VehicleProfile, ground_speed_m_s: float) -> CompiledDrop:
    """Return the items of one drop, and what the run needs to know about it."""
    place = _place(drop)
    hold_seqs = _add_hold(drafts, drop, place)
    release_seq = None
    if not drop.supervised:
        release_seq = drafts.add(drop.item.id, drop.item.release_draft())
        if drop.stopped:
            drafts.add(drop.item.id, delay_draft(settle_s(drop.item, facts)))
    stops_in_air = drop.stopped and drop.carried is FlightRegime.ROTARY_WING
    own_m, reach_m = place.reach_m(), behaviour(facts).reach_m
    radius_m = stop_radius_m(own_m) if stops_in_air else reach_m(drop.carried, ground_speed_m_s, own_m)
    release = drop.item.release_draft()
    return CompiledDrop(
        plan_item_id=drop.item.id,
        supervised=drop.supervised,
        stopped=drop.stopped,
        hold_seqs=hold_seqs,
        resume_seq=hold_seqs[-1] + 1 if drop.supervised else drafts.next_seq,
        release_seq=release_seq,
        command=release.command,
        params=(*release.params, NAN, NAN, NAN),
        latitude_deg=place.latitude_deg,
        longitude_deg=place.longitude_deg,
        hold_s=bound_s(drop),
        acceptance_radius_m=radius_m,
        relative_altitude_m=place.relative_altitude_m if stops_in_air else None,
        absolute_altitude_m=place.absolute_altitude_m if stops_in_air else None,
        landed=drop.carried is FlightRegime.GROUND,
        needs_consent=drop.item.consent == "operator",
        consent_timeout_s=drop.item.consent_timeout_s,
    )


def brakes_at_waypoint(drop: DropUse) -> bool:
    """The hold is part of the waypoint. What precedes a supervised drop there is done before: the end of its hold may
    be a jump over everything up to the item after its alternate.
    """
    return _stops_at_waypoint(drop) and not (drop.supervised and (drop.delayed or drop.prepared))


def brakes_to_prepare(drop: DropUse) -> bool:
    """The waypoint stops for what is done before the drop, such as a photo. The drop has a hold of its own."""
    return _stops_at_waypoint(drop) and drop.supervised and drop.prepared


def _stops_at_waypoint(drop: DropUse) -> bool:
    return (
        drop.first
        and drop.stopped
        and drop.carried is FlightRegime.ROTARY_WING
        and drop.anchor is not None
        and drop.anchor.item.holds()
    )


def braking_at(drops: Iterable[DropUse]) -> Iterator[tuple[Step, DropUse]]:
    """Return the waypoints at which a rotary wing brakes, each with its drop."""
    for drop in drops:
        if drop.anchor is not None and (brakes_at_waypoint(drop) or brakes_to_prepare(drop)):
            yield drop.anchor, drop


def holds_apart(drop: DropUse) -> bool:
    """A rotary wing stops for this drop at a waypoint of the drop's own: its position item does not brake for it."""
    return drop.stopped and drop.carried is FlightRegime.ROTARY_WING and not brakes_at_waypoint(drop)


def bound_s(drop: DropUse) -> float:
    """How long the vehicle waits for a release command."""
    brakes = brakes_at_waypoint(drop)
    if not drop.supervised:
        return EMBEDDED_HOLD_S if brakes else 0.0
    return max(drop.item.hold_s, drop.anchor.item.hovers_s() if drop.anchor is not None and brakes else 0.0)


def settle_s(item: Drop, facts: VehicleProfile) -> float:
    """Duration of an embedded, stopped drop."""
    return item.settle_s(quantity(facts, Quantity.GRIPPER_S))


def stop_radius_m(own_m: float | None) -> float:
    """Acceptance radius of a stop: the item's own if smaller than the radius that makes the vehicle stop."""
    return min(own_m or STOP_RADIUS_M, STOP_RADIUS_M)


def _add_hold(drafts: DraftList, drop: DropUse, place: Stop) -> tuple[int, ...]:
    """Return where the vehicle waits for this drop. Adds items if its waypoint does not hold."""
    anchor_seq = drafts.last_seq_of(place.id)
    if brakes_at_waypoint(drop) and drop.supervised:
        return (anchor_seq,)
    if holds_apart(drop):
        own = drafts.add(drop.item.id, place.waypoint_draft(_apart_s(drop), stop_radius_m(place.reach_m())))
        return tuple(range(anchor_seq, own + 1)) if drop.first and not drop.supervised else (own,)
    if drop.first and not drop.supervised:
        return tuple(range(anchor_seq, drafts.next_seq))
    own = drafts.add(drop.item.id, delay_draft(drop.item.hold_s + _leave_s(drop) if drop.supervised else PAUSE_S))
    return (anchor_seq, own) if anchor_seq == own - 1 else (own,)


def _apart_s(drop: DropUse) -> float:
    """An embedded drop has no other check that the vehicle is at rest; the second one at a place begins at rest."""
    if drop.supervised:
        return drop.item.hold_s + _leave_s(drop)
    return EMBEDDED_HOLD_S if drop.first else PAUSE_S


def _leave_s(drop: DropUse) -> float:
    return 0.0 if drop.alternate is None else LEAVE_S


def _place(drop: DropUse) -> Stop:
    item = drop.anchor.item if drop.anchor is not None else None
    if not isinstance(item, Stop):
        raise PlanRejectedError(f"the drop {drop.item.id} does not follow a waypoint, loiter or landing")
    return item


_VERTEX = {
    "inclusion": MavCmd.NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    "exclusion": MavCmd.NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
}
_CIRCLE = {"inclusion": MavCmd.NAV_FENCE_CIRCLE_INCLUSION, "exclusion": MavCmd.NAV_FENCE_CIRCLE_EXCLUSION}


def fence_items(fence: Geofence) -> tuple[MissionItem, ...]:
    """param1 of a polygon vertex is the number of vertices, param1 of a circle is its radius in metres."""
    points = enumerate(_fence_points(fence))
    return tuple(_fence_item(seq, command, param1, x, y) for seq, (command, param1, x, y) in points)


def rally_items(points: tuple[RallyPoint, ...]) -> tuple[MissionItem, ...]:
    """NAV_RALLY_POINT items. Unused parameters are 0, as PX4 reads them back."""
    return tuple(_rally_item(seq, point) for seq, point in enumerate(points))


def _fence_points(fence: Geofence) -> Iterator[tuple[MavCmd, float, int, int]]:
    for polygon in fence.polygons:
        for vertex in polygon.vertices:
            corner = degrees_e7(vertex.latitude_deg), degrees_e7(vertex.longitude_deg)
            yield _VERTEX[polygon.kind], float(len(polygon.vertices)), *corner
    for circle in fence.circles:
        yield _CIRCLE[circle.kind], circle.radius_m, degrees_e7(circle.latitude_deg), degrees_e7(circle.longitude_deg)


def _fence_item(seq: int, command: MavCmd, param1: float, x: int, y: int) -> MissionItem:
    # PX4 always reads back frame 5 and autocontinue 0 (observed).
    return MissionItem(
        seq,
        MavFrame.GLOBAL_INT,
        command,
        param1,
        0.0,
        0.0,
        0.0,
        x=x,
        y=y,
        current=seq == 0,
        autocontinue=False,
        mission_type=MissionType.FENCE,
    )


def _rally_item(seq: int, point: RallyPoint) -> MissionItem:
    absolute = point.absolute_altitude_m
    return MissionItem(
        seq,
        MavFrame.GLOBAL_RELATIVE_ALT_INT if absolute is None else MavFrame.GLOBAL_INT,
        MavCmd.NAV_RALLY_POINT,
        0.0,
        0.0,
        0.0,
        0.0,
        x=degrees_e7(point.latitude_deg),
        y=degrees_e7(point.longitude_deg),
        z=point.relative_altitude_m or 0.0 if absolute is None else absolute,
        current=seq == 0,
        mission_type=MissionType.RALLY,
    )


# Compiles the detour to an alternate: part of the mission from the start, and skipped by a jump before it.
#
# hold at the drop, DO_JUMP (to the item after the detour), waypoint of the alternate (and delay), next item
#
# Without a command the vehicle always takes the jump. Only MISSION_SET_CURRENT leads into the detour, and at its end
# the
# mission continues.


ALWAYS: Final = 65535.0
"""The maximum repeat count of DO_JUMP. PX4 stores it unsigned, so MAVLink's -1 for "unlimited" could become 0, a jump
that is never taken.
"""


def add_detour(
    drafts: DraftList, failed: CompiledDrop, there: DropUse, facts: VehicleProfile, ground_speed_m_s: float
) -> CompiledDrop:
    """Append the jump and the alternate's items. Returns the drop with its alternate."""
    place = there.anchor.item if there.anchor is not None else None
    assert isinstance(place, Stop), "an alternate needs a position and a drop"
    jump_seq = drafts.add(failed.plan_item_id, command_draft(MavCmd.DO_JUMP, ALWAYS, ALWAYS))
    first_seq = drafts.next_seq
    if brakes_at_waypoint(there):
        add_waypoint_with_drop(drafts, place, there)
    else:
        drafts.add(place.id, place.waypoint_draft(0.0, None))
    alternate = add_drop(drafts, there, facts, ground_speed_m_s)
    follows = drafts.next_seq
    drafts.drafts[jump_seq] = command_draft(MavCmd.DO_JUMP, float(follows), ALWAYS)
    return replace(failed, resume_seq=follows, alternate=alternate, alternate_seq=first_seq, leave_s=LEAVE_S)


@dataclass(frozen=True, slots=True)
class DraftedPlan:
    """A plan as the items of its mission, before they become MISSION_ITEM_INTs. `seqs_of`: of each plan item."""

    plan: Plan
    drafts: DraftList
    drops: tuple[CompiledDrop, ...]
    seqs_of: Mapping[str, Sequence[int]]

    def mission(self) -> Mission:
        """Number the items, and add the fence and the rally points."""
        return Mission(
            items=self.drafts.number(self.seqs_of),
            fence=fence_items(self.plan.geofence),
            rally=rally_items(self.plan.rally_points),
            plan_item_of=self.drafts.plan_item_of(),
            drops=self.drops,
        )


def compile_plan(plan: Plan, facts: VehicleProfile) -> Mission:
    """Compile a plan that passed the rules to MISSION_ITEM_INT lists, for a vehicle with these facts.

    Raises PlanRejectedError, as `draft`. All other problems are reported by the rules.
    """
    return draft(plan, facts, walk(plan, reference_home(plan, facts), in_flight=facts.in_flight)).mission()


def mission_seqs(plan: Plan, facts: VehicleProfile, steps: Sequence[Step]) -> Mapping[str, Sequence[int]]:
    """Return the sequence numbers of each plan item, empty if the plan does not compile.

    They do not depend on the vehicle's parameters.
    """
    try:
        return draft(plan, facts, steps).seqs_of
    except PlanRejectedError:
        return {}


def draft(plan: Plan, facts: VehicleProfile, steps: Sequence[Step]) -> DraftedPlan:
    """Draft the mission of a plan; `steps` are the walk in its order.

    Raises PlanRejectedError if the plan has no mission: a vehicle of another type, a drop without a position, a jump
    without a target, loiter turns.
    """
    drafts, compiled = _drafted(plan, facts, reference_home(plan, facts), steps)
    return DraftedPlan(plan, drafts, tuple(compiled), drafts.seqs_of())


def _drafted(
    plan: Plan, facts: VehicleProfile, home: GlobalPosition, steps: Sequence[Step]
) -> tuple[DraftList, list[CompiledDrop]]:
    if facts.vehicle_type is not plan.vehicle_type:
        raise PlanRejectedError(
            f"the plan is for {plan.vehicle_type.noun}, but the vehicle is {facts.vehicle_type.noun}"
        )
    drops = {drop.step.index: drop for drop in drops_of(steps)}
    braking = {anchor.index: drop for anchor, drop in braking_at(drops.values())}
    drafts = DraftList()
    compiled: list[CompiledDrop] = []
    speeds = speeds_along(plan, facts, steps) if drops else ()
    for step in steps:
        if step.index == 0:
            _add_cruise_speed(drafts, plan, step, facts)
        if step.index in drops:
            compiled += _add_drop(drafts, drops[step.index], home, facts, speeds[step.index])
        elif step.index in braking:
            _add_braking_waypoint(drafts, step, braking[step.index], plan.vehicle_type)
        else:
            for draft in step.item.drafts(Leg(step.start, step.end, home, facts)):
                drafts.add(step.item.id, draft)
            if step.item.takes_off:
                _add_cruise_speed_after_takeoff(drafts, plan, step)
    _end_with_no_release(drafts, compiled)
    return drafts, compiled


def _add_drop(
    drafts: DraftList, drop: DropUse, home: GlobalPosition, facts: VehicleProfile, speed_m_s: float
) -> list[CompiledDrop]:
    """Return the drop with its alternate, None if it releases no parcel."""
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


def _add_cruise_speed(drafts: DraftList, plan: Plan, step: Step, facts: VehicleProfile) -> None:
    """A rover has no takeoff, and a vehicle in flight is past it: their speed is set first."""
    speed_m_s = plan.cruise_speed_m_s if plan.vehicle_type is VehicleType.ROVER else None
    if facts.in_flight is not None:
        speed_m_s = facts.in_flight.asked_speed_m_s
    for draft in speed_drafts(speed_m_s, plan.vehicle_type):
        drafts.add(step.item.id, draft)


def _add_cruise_speed_after_takeoff(drafts: DraftList, plan: Plan, step: Step) -> None:
    """After the takeoff, because PX4 sets the speed of the current flight regime."""
    if plan.vehicle_type is not VehicleType.ROVER:
        for draft in speed_drafts(plan.cruise_speed_m_s, plan.vehicle_type):
            drafts.add(step.item.id, draft)


def _end_with_no_release(drafts: DraftList, compiled: list[CompiledDrop]) -> None:
    """An item must follow a drop, because a supervised run advances the mission to it."""
    if compiled and compiled[-1].resume_seq == drafts.next_seq:
        drafts.add(compiled[-1].plan_item_id, delay_draft(PAUSE_S))
