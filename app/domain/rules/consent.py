"""Rules for an operator's consent: only a supervised drop can ask for it, and only within its hold."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.compiler.drop_items import bound_s
from app.domain.consent import CONSENT_MARGIN_S, SHORTEST_QUESTION_S
from app.domain.finding import Severity
from app.domain.rules.registry import Rule, RuleContext, Violation, at_item


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


RULES = (
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
