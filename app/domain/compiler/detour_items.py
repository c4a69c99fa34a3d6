"""The way to an alternate as mission items: on board from the start, and passed over by a jump before it.

    hold at the drop, DO_JUMP (to what follows), the alternate's waypoint (and delay), what follows

A vehicle that is told nothing always takes the jump: only an item that is made current from outside leads into the
detour, and from its end the mission goes on by itself.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from app.domain.compiler.draft import DraftList
from app.domain.compiler.drop_items import add_drop, add_waypoint_with_drop, brakes_at_waypoint
from app.domain.items import Stop
from app.domain.items.draft import command_draft
from app.domain.mission import CompiledDrop, MavCmd
from app.domain.plan.detour import LEAVE_S
from app.domain.plan.drops import DropUse
from app.domain.vehicle import VehicleFacts

ALWAYS: Final = 65535.0
"""DO_JUMP's repeats as often as PX4 can count. It stores them unsigned, so the -1 of the MAVLink page may become 0,
and that would be a jump that is never taken."""


def add_detour(
    drafts: DraftList, failed: CompiledDrop, there: DropUse, facts: VehicleFacts, ground_speed_m_s: float
) -> CompiledDrop:
    """Adds the jump and the alternate's items. The drop before them, with its alternate."""
    place = there.anchor.item if there.anchor is not None else None
    assert isinstance(place, Stop), "an alternate is a place and a drop"
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
