"""Drops as mission items: each expectation of the plan becomes items that really have that effect on PX4.

A stopped drop from a rotary wing: hold and acceptance radius together at the waypoint (the gripper item itself does not
brake in current firmware). On the ground and on wheels: NAV_DELAY. A moving drop: no hold at all.
"""

from __future__ import annotations

from app.domain.autopilot import Quantity, behaviour, quantity
from app.domain.carried import Carried
from app.domain.compiler.draft import DraftList
from app.domain.errors import PlanRejectedError
from app.domain.items import Drop, Stop
from app.domain.items.delay import delay_draft
from app.domain.mission import NAN, CompiledDrop
from app.domain.plan.detour import LEAVE_S
from app.domain.plan.drops import DropUse
from app.domain.vehicle import VehicleFacts

STOP_RADIUS_M = 1.0
"""Acceptance radius of a stop. Flown: 1 m with a hold stops 0.9 m away at 0.1 m/s; the default 10 m does not stop."""
EMBEDDED_HOLD_S = 5.0
"""Hold before an embedded release: with 1 m radius it leaves time to come to rest (flown with 5 s)."""
PAUSE_S = 1.0
"""Between two drops at one place, and after a drop that is the last item: something that is no release must follow."""


def add_waypoint_with_drop(drafts: DraftList, item: Stop, drop: DropUse) -> None:
    """The waypoint of a stopped drop from a rotary wing: it brakes there and waits."""
    hold_s = drop.item.hold_s if drop.supervised else EMBEDDED_HOLD_S
    hold_s = max(hold_s, item.hovers_s()) + _leave_s(drop)
    drafts.add(item.id, item.waypoint_draft(hold_s, stop_radius_m(item.reach_m())))


def add_drop(drafts: DraftList, drop: DropUse, facts: VehicleFacts, ground_speed_m_s: float) -> CompiledDrop:
    """The items of one drop, and what the run must know of them."""
    place = _place(drop)
    hold_seqs = _add_hold(drafts, drop, place)
    release_seq = None
    if not drop.supervised:
        release_seq = drafts.add(drop.item.id, drop.item.release_draft())
        if drop.stopped:
            drafts.add(drop.item.id, delay_draft(settle_s(drop.item, facts)))
    stops_in_air = drop.stopped and drop.carried is Carried.ROTARY_WING
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
        landed=drop.carried is Carried.GROUND,
        needs_consent=drop.item.consent == "operator",
        consent_timeout_s=drop.item.consent_timeout_s,
    )


def brakes_at_waypoint(drop: DropUse) -> bool:
    """The hold of this drop is part of its waypoint. A supervised one is commanded there, so a delay must be over."""
    return (
        drop.first
        and not (drop.supervised and drop.delayed)
        and drop.stopped
        and drop.carried is Carried.ROTARY_WING
        and drop.anchor is not None
        and drop.anchor.item.holds()
    )


def bound_s(drop: DropUse) -> float:
    """How long a release can be sent to the vehicle that waits for this drop."""
    brakes = brakes_at_waypoint(drop)
    if not drop.supervised:
        return EMBEDDED_HOLD_S if brakes else 0.0
    return max(drop.item.hold_s, drop.anchor.item.hovers_s() if drop.anchor is not None and brakes else 0.0)


def settle_s(item: Drop, facts: VehicleFacts) -> float:
    """How long an embedded, stopped drop takes."""
    return item.settle_s(quantity(facts, Quantity.GRIPPER_S))


def stop_radius_m(own_m: float | None) -> float:
    """Acceptance radius of a stop: the item's own if it is smaller than what makes it stop."""
    return min(own_m or STOP_RADIUS_M, STOP_RADIUS_M)


def _add_hold(drafts: DraftList, drop: DropUse, place: Stop) -> tuple[int, ...]:
    """Where the vehicle waits for this drop; adds items if the place itself does not hold."""
    anchor_seqs = [seq for seq, owner in enumerate(drafts.owners) if owner == place.id]
    if brakes_at_waypoint(drop) and drop.supervised:
        return (anchor_seqs[-1],)
    if drop.first and not drop.supervised:
        return tuple(range(anchor_seqs[-1], drafts.next_seq))
    if drop.carried is Carried.ROTARY_WING and drop.stopped:
        hold_s = drop.item.hold_s + _leave_s(drop) if drop.supervised else PAUSE_S
        return (drafts.add(drop.item.id, place.waypoint_draft(hold_s, stop_radius_m(place.reach_m()))),)
    own = drafts.add(drop.item.id, delay_draft(drop.item.hold_s + _leave_s(drop) if drop.supervised else PAUSE_S))
    return (anchor_seqs[-1], own) if anchor_seqs[-1] == own - 1 else (own,)


def _leave_s(drop: DropUse) -> float:
    return 0.0 if drop.alternate is None else LEAVE_S


def _place(drop: DropUse) -> Stop:
    item = drop.anchor.item if drop.anchor is not None else None
    if not isinstance(item, Stop):
        raise PlanRejectedError(f"the drop {drop.item.id} follows no waypoint, loiter or landing")
    return item
