"""Rules for alternates: where a drop can have another place, and what keeps a vehicle from going there by itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from app.domain.finding import Severity
from app.domain.geo import distance_m
from app.domain.items.alternate import Alternate
from app.domain.plan.drops import DropUse
from app.domain.rules.registry import Rule, RuleContext, Violation, at_item

NEAREST_M: Final = 10.0


def _possible(context: RuleContext) -> Iterator[Violation]:
    for drop, _ in _with_alternate(context):
        if drop.anchor is None or drop.alternate is not None:
            continue  # without a place: another rule's business
        if not drop.releases:
            message, hint = "a grab has no alternate", "take it away"
        elif not drop.supervised:
            message = "nobody sees an embedded drop fail in time to fly on, so it has no alternate"
            hint = 'use "mode": "supervised", or take it away'
        else:
            message = "a vehicle that landed for its drop cannot go on to an alternate by a waypoint alone"
            hint = "drop while hovering, or take the alternate away"
        yield at_item(drop.step, message, hint, "alternate")


def _last_at_its_place(context: RuleContext) -> Iterator[Violation]:
    for drop, _ in _with_alternate(context):
        for other in context.drops:
            same = drop.anchor is not None and other.step.anchor == drop.step.anchor
            if same and other.step.index > drop.step.index:
                message = f"{other.item.id} follows at the same place, but the vehicle may be at the alternate then"
                yield at_item(
                    drop.step, message, "put the drop with the alternate last, or repeat the waypoint", "alternate"
                )


def _return_skips_it(context: RuleContext) -> Iterator[Violation]:
    returns = context.behaviour.returns
    if not returns.may_follow_items:
        return
    for drop, _ in _with_alternate(context):
        message = f"with {returns.setting} a return may follow the mission's items and fly to the alternate"
        yield at_item(drop.step, message, returns.setting.mend, "alternate")


def _elsewhere(context: RuleContext) -> Iterator[Violation]:
    for drop, alternate in _with_alternate(context):
        if drop.anchor is None:
            continue
        end = drop.anchor.end
        away_m = distance_m(end.latitude_deg, end.longitude_deg, alternate.latitude_deg, alternate.longitude_deg)
        if away_m < NEAREST_M:
            message = (
                f"the alternate is {away_m:.0f} m from the drop's own place: what keeps one from it may keep it here"
            )
            yield at_item(drop.step, message, f"choose a place at least {NEAREST_M:g} m away", "alternate")


def _with_alternate(context: RuleContext) -> Iterator[tuple[DropUse, Alternate]]:
    for drop in context.drops:
        if (there := drop.item.other_place()) is not None:
            yield drop, there


RULES = (
    Rule(
        "alternate.not_possible",
        Severity.ERROR,
        "Only a supervised release in the air or on wheels is known to have failed while the vehicle can still go on.",
        "The rule is ours alone.",
        _possible,
    ),
    Rule(
        "alternate.more_at_the_place",
        Severity.ERROR,
        "From the alternate the mission goes on: what is left to do at the first place would be done there.",
        "The rule is ours alone.",
        _last_at_its_place,
    ),
    Rule(
        "alternate.return_along_items",
        Severity.ERROR,
        "An alternate is on board as items that the mission jumps over. RTL_TYPE 2, 4 and 6 go to the nearest item or "
        "backwards along all of them: a vehicle without a link would fly there by itself.",
        "PX4 rtl_mission_fast.cpp, rtl_mission_fast_reverse.cpp: setMissionToClosestItem, getPreviousPositionItems.",
        _return_skips_it,
    ),
    Rule(
        "alternate.same_place",
        Severity.WARNING,
        "An alternate is for what is wrong with the place.",
        "Ours.",
        _elsewhere,
    ),
)
