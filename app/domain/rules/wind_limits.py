"""Rules for the wind that a check is given: what moves through the air must be faster than it."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.carried import Carried
from app.domain.finding import Severity
from app.domain.plan.walk import Step
from app.domain.rules.registry import Rule, RuleContext, Violation, at_item

_THROUGH_AIR = (Carried.FIXED_WING, Carried.BUOYANCY)


def _faster_than_wind(context: RuleContext) -> Iterator[Violation]:
    wind_m_s, before_m_s = context.wind.speed_m_s, 0.0
    for step, own_m_s in zip(context.steps, context.speeds_m_s, strict=True):
        airspeed_m_s = own_m_s or before_m_s  # a landing flies at the speed before it
        before_m_s = airspeed_m_s
        if wind_m_s > 0.0 and _is_carried_by_air(step) and airspeed_m_s <= wind_m_s:
            message = f"flown at {airspeed_m_s:g} m/s through the air, in a wind of {wind_m_s:g} m/s: it is blown away"
            yield at_item(step, message, "wait for less wind, or fly faster")
            return


def _is_carried_by_air(step: Step) -> bool:
    return step.item.moves and (step.after in _THROUGH_AIR or step.before in _THROUGH_AIR)


RULES = (
    Rule(
        "wind.too_strong",
        Severity.ERROR,
        "A wing or an airship that is no faster than the wind does not hold its way against it.",
        "Ours; the wind is the one that the check was given.",
        _faster_than_wind,
    ),
)
