"""Rules for alternates and for operator consent."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Final

from app.domain.drop.consent import CONSENT_MARGIN_S, SHORTEST_QUESTION_S
from app.domain.geo import distance_m
from app.domain.items.drop_places import Alternate
from app.domain.plan.compiler import bound_s
from app.domain.plan.drops import Detour, DropUse
from app.domain.rules.registry import RuleContext, RuleSet, Violation, at_item
from app.domain.validation.finding import Finding

rules = RuleSet()


@rules.error(
    "drop.consent_unsupervised",
    "An embedded drop or a grab is executed on board, with or without a link, so consent cannot be requested.",
    "Waydrop.",
)
def _asked_while_holding(context: RuleContext) -> Iterator[Violation]:
    for drop in context.drops:
        if drop.item.consent == "operator" and not drop.supervised:
            message = "consent cannot be requested: the drop is a mission item, which the vehicle executes by itself"
            yield at_item(drop.step, message, 'use "mode": "supervised" for a release, or remove consent', "consent")


@rules.error(
    "drop.consent_hold_too_short",
    f"The hold must exceed the time to answer by {CONSENT_MARGIN_S:g} s, to detect the hold, come to rest and "
    f"release. Without consent_timeout_s, the operator needs at least {SHORTEST_QUESTION_S:g} s.",
    "Waydrop.",
)
def _hold_is_long_enough(context: RuleContext) -> Iterator[Violation]:
    for drop in context.drops:
        if drop.item.consent != "operator" or not drop.supervised:
            continue
        needed_s = (drop.item.consent_timeout_s or SHORTEST_QUESTION_S) + CONSENT_MARGIN_S
        if bound_s(drop) < needed_s:
            message = f"the hold of {bound_s(drop):g} s ends before an operator can answer"
            yield at_item(
                drop.step, message, f"set hold_s to at least {needed_s:g}, or reduce consent_timeout_s", "hold_s"
            )


@rules.warning(
    "drop.consent_timeout_unused", "A consent timeout applies only to a drop that requests consent.", "Waydrop."
)
def _timeout_is_used(context: RuleContext) -> Iterator[Violation]:
    for drop in context.drops:
        if drop.item.consent_timeout_s is not None and drop.item.consent == "none":
            message = "the drop does not request consent, so the timeout has no effect"
            yield at_item(
                drop.step, message, 'add "consent": "operator", or remove consent_timeout_s', "consent_timeout_s"
            )


NEAREST_M: Final = 10.0


@rules.error(
    "alternate.not_possible",
    "Only a supervised release in the air or on wheels can fail while the vehicle is still able to continue.",
    "Waydrop.",
)
def _possible(context: RuleContext) -> Iterator[Violation]:
    for drop, _ in _with_alternate(context):
        if drop.anchor is None or drop.alternate is not None:
            continue  # without a position: reported by another rule
        if not drop.releases:
            message, hint = "a grab has no alternate", "remove it"
        elif not drop.supervised:
            message = "the failure of an embedded drop cannot be detected in time, so it has no alternate"
            hint = 'use "mode": "supervised", or remove the alternate'
        else:
            message = "a vehicle that landed for its drop cannot continue to an alternate with a waypoint alone"
            hint = "drop while hovering, or remove the alternate"
        yield at_item(drop.step, message, hint, "alternate")


@rules.error(
    "alternate.more_at_the_place",
    "The mission continues from the alternate, so anything left to do at the drop would be done there.",
    "Waydrop.",
)
def _last_at_its_place(context: RuleContext) -> Iterator[Violation]:
    for drop, _ in _with_alternate(context):
        for other in context.drops:
            same = drop.anchor is not None and other.step.anchor == drop.step.anchor
            if same and other.step.index > drop.step.index:
                message = (
                    f"{other.item.id} follows at the same position, but the vehicle may be at the alternate by then"
                )
                yield at_item(
                    drop.step,
                    message,
                    "move the drop with the alternate to the end, or repeat the waypoint",
                    "alternate",
                )


@rules.error(
    "alternate.return_along_items",
    "An alternate is stored in the mission as items that a jump skips. RTL_TYPE 2, 4 and 6 return to the nearest "
    "item or backwards along the items: without a link, the vehicle could fly there by itself.",
    "PX4 rtl_mission_fast.cpp, rtl_mission_fast_reverse.cpp: setMissionToClosestItem, getPreviousPositionItems.",
)
def _return_skips_it(context: RuleContext) -> Iterator[Violation]:
    returns = context.behaviour.returns
    if not returns.may_follow_items:
        return
    for drop, _ in _with_alternate(context):
        message = f"with {returns.setting}, a return may follow the mission items and fly to the alternate"
        yield at_item(drop.step, message, returns.setting.remedy, "alternate")


@rules.warning(
    "alternate.same_place", "An alternate covers problems at the drop's position, so it must be elsewhere.", "Waydrop."
)
def _elsewhere(context: RuleContext) -> Iterator[Violation]:
    for drop, alternate in _with_alternate(context):
        if drop.anchor is None:
            continue
        end = drop.anchor.end
        away_m = distance_m(end.latitude_deg, end.longitude_deg, alternate.latitude_deg, alternate.longitude_deg)
        if away_m < NEAREST_M:
            message = f"the alternate is only {away_m:.0f} m from the drop, so it may have the same problem"
            yield at_item(drop.step, message, f"choose a position at least {NEAREST_M:g} m away", "alternate")


def _with_alternate(context: RuleContext) -> Iterator[tuple[DropUse, Alternate]]:
    for drop in context.drops:
        if (there := drop.item.other_place()) is not None:
            yield drop, there


def detour_findings(detour: Detour, found: Collection[Finding], known: Collection[Finding]) -> Iterator[Finding]:
    """Return the findings of the route over the alternates, with pointers into the original plan.

    `found` are the findings of the detour's plan, `known` those of the original plan.
    """
    reported = {(finding.code, finding.pointer) for finding in known}
    for finding in found:
        pointer = _pointer(detour, finding.pointer)
        if (finding.code, pointer) not in reported:
            item_id = detour.drops.get(finding.item_id or "", finding.item_id)
            message = f"over the alternate: {finding.message}"
            yield finding.model_copy(update={"pointer": pointer, "item_id": item_id, "message": message})


def _pointer(detour: Detour, pointer: str) -> str:
    """Convert /items/N/rest from the plan of the detour to the original plan."""
    parts = pointer.split("/", 3)
    if len(parts) < 3 or parts[1] != "items":
        return pointer
    return "/".join((detour.pointers[int(parts[2])], *parts[3:]))
