"""Rules for alternates: where a drop can have another place, and what keeps a vehicle from going there by itself."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Final

from app.domain.drop.consent import CONSENT_MARGIN_S, SHORTEST_QUESTION_S
from app.domain.geo import distance_m
from app.domain.items.drop_places import Alternate
from app.domain.plan.compiler import bound_s
from app.domain.plan.drops import Detour, DropUse
from app.domain.rules.registry import Rule, RuleContext, Violation, at_item
from app.domain.validation.finding import Finding, Severity

# Rules for an operator's consent: only a supervised drop can ask for it, and only within its hold.


def _asked_while_holding(context: RuleContext) -> Iterator[Violation]:
    for drop in context.drops:
        if drop.item.consent == "operator" and not drop.supervised:
            message = (
                "nobody can be asked for consent: the drop is an item of the mission, which the vehicle flies alone"
            )
            yield at_item(drop.step, message, 'use "mode": "supervised" for a release, or leave consent out', "consent")


def _hold_is_long_enough(context: RuleContext) -> Iterator[Violation]:
    for drop in context.drops:
        if drop.item.consent != "operator" or not drop.supervised:
            continue
        needed_s = (drop.item.consent_timeout_s or SHORTEST_QUESTION_S) + CONSENT_MARGIN_S
        if bound_s(drop) < needed_s:
            message = f"the hold of {bound_s(drop):g} s ends before an operator can have answered"
            yield at_item(
                drop.step, message, f"set hold_s to {needed_s:g} or more, or ask for a shorter time", "hold_s"
            )


def _timeout_is_used(context: RuleContext) -> Iterator[Violation]:
    for drop in context.drops:
        if drop.item.consent_timeout_s is not None and drop.item.consent == "none":
            message = "the drop asks nobody, so there is nothing to wait for"
            yield at_item(drop.step, message, 'add "consent": "operator", or leave it out', "consent_timeout_s")


CONSENT_RULES = (
    Rule(
        "drop.consent_unsupervised",
        Severity.ERROR,
        "An embedded drop or a grab happens on board, with a link or without: nobody is asked.",
        "The rule is ours alone.",
        _asked_while_holding,
    ),
    Rule(
        "drop.consent_hold_too_short",
        Severity.ERROR,
        f"A hold must outlast the time to answer by {CONSENT_MARGIN_S:g} s: to see it begin, to come to rest, and to "
        f"release. Without consent_timeout_s an operator must have {SHORTEST_QUESTION_S:g} s at least.",
        "The rule is ours alone.",
        _hold_is_long_enough,
    ),
    Rule(
        "drop.consent_timeout_unused",
        Severity.WARNING,
        "A time to answer is only for a drop that asks.",
        "The rule is ours alone.",
        _timeout_is_used,
    ),
)


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


# Checks the way over the alternates by the same rules as the flight that is meant.


def detour_findings(detour: Detour, found: Collection[Finding], known: Collection[Finding]) -> Iterator[Finding]:
    """What is wrong on the way over the alternates alone, with pointers into the plan as it was written.

    `found` are the findings of the detour's own plan, `known` those of the plan that is meant.
    """
    told = {(finding.code, finding.pointer) for finding in known}
    for finding in found:
        pointer = _pointer(detour, finding.pointer)
        if (finding.code, pointer) not in told:
            item_id = detour.drops.get(finding.item_id or "", finding.item_id)
            message = f"over the alternate: {finding.message}"
            yield finding.model_copy(update={"pointer": pointer, "item_id": item_id, "message": message})


def _pointer(detour: Detour, pointer: str) -> str:
    """/items/N/rest, with the N of the plan over its alternates, as it is in the plan itself."""
    parts = pointer.split("/", 3)
    if len(parts) < 3 or parts[1] != "items":
        return pointer
    return "/".join((detour.pointers[int(parts[2])], *parts[3:]))
