"""Rules for the battery: what is predicted to be left where the flight ends, and at each drop."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.compiler.drop_items import bound_s
from app.domain.finding import Severity
from app.domain.performance import Performance, Phase
from app.domain.plan.drops import DropUse
from app.domain.prediction import PredictedDrop
from app.domain.rules.registry import Rule, RuleContext, Violation, at_item

FULL_PERCENT = 100.0


def _left_at_home(context: RuleContext) -> Iterator[Violation]:
    performance = _performance(context)
    if performance is None:
        return
    used = context.timeline().battery_used_percent or 0.0
    reserve, why = _reserve(context, performance)
    start, left = _start_percent(context), _start_percent(context) - used
    if left < reserve:
        message = (
            f"the flight takes {used:.0f} % of the battery and begins with {start:.0f} %: {_left(left)} is left where "
            f"it ends, less than {reserve:g} % ({why})"
        )
        yield at_item(context.steps[-1], message, "charge or change the battery, shorten the flight, or split the plan")


def _left_at_drops(context: RuleContext) -> Iterator[Violation]:
    performance = _performance(context)
    if performance is None:
        return
    reserve, why = _reserve(context, performance)
    drops = {drop.item.id: drop for drop in context.drops}
    told: set[str] = set()
    for predicted in context.timeline().drops:
        drop = drops[predicted.item_id]
        left = _left_after_worst(context, performance, drop, predicted)
        if left < reserve and predicted.item_id not in told:
            told.add(predicted.item_id)
            how = "the return" if _returns_on_failure(context) else "the rest of the plan"
            message = f"after the longest hold here and {how} {_left(left)} is left, less than {reserve:g} % ({why})"
            yield at_item(drop.step, message, "shorten hold_s, drop nearer to home, or charge the battery")


def _rate_declared(context: RuleContext) -> Iterator[Violation]:
    if context.vehicle is not None and _performance(context) is None:
        message = "nobody declared what this vehicle takes from its battery: whether it lasts is not checked"
        yield Violation("", message, "declare it in WAYDROP_VEHICLE_PERFORMANCE")


def _charge_known(context: RuleContext) -> Iterator[Violation]:
    if context.vehicle is not None and _performance(context) is not None and context.facts.battery_percent is None:
        message = "the vehicle tells no charge of its battery: a full one is taken"
        yield Violation("", message, "look at the battery before the start, or let the vehicle send BATTERY_STATUS")


def _acts_by_itself(context: RuleContext) -> Iterator[Violation]:
    if context.vehicle is None:
        return
    low = context.behaviour.low_battery
    if low.only_warns:
        message = f"the vehicle only warns when its battery is nearly empty ({low.setting})"
        yield Violation("", message, low.setting.mend)


def _performance(context: RuleContext) -> Performance | None:
    performance = context.facts.performance
    return performance if performance is not None and performance.tells_energy else None


def _start_percent(context: RuleContext) -> float:
    charge = context.facts.battery_percent
    return FULL_PERCENT if charge is None else charge


def _reserve(context: RuleContext, performance: Performance) -> tuple[float, str]:
    """The highest of all that ask for one, and who asks."""
    asked = [(performance.reserve_percent, "the vehicle's reserve_percent")]
    if context.plan.limits.min_battery_percent is not None:
        asked.append((context.plan.limits.min_battery_percent, "limits.min_battery_percent"))
    acts_below = context.behaviour.low_battery.acts_below
    if acts_below is not None:
        asked.append((acts_below.value, f"{acts_below.name}: there it returns or lands by itself"))
    return max(asked)


def _left_after_worst(context: RuleContext, performance: Performance, drop: DropUse, predicted: PredictedDrop) -> float:
    """The whole hold is used up and nothing was dropped; then what the plan says of a failed drop."""
    used = rest = 0.0
    for entry in context.timeline().entries:
        percent = entry.battery_used_percent or 0.0
        if entry.start_s < predicted.at_s:
            used += percent
        elif (entry.item_id, entry.visit) != (predicted.item_id, predicted.visit):
            rest += percent
    used += bound_s(drop) * performance.percent_per_s(Phase.HOVER)
    after = predicted.return_battery_percent if _returns_on_failure(context) else rest
    return _start_percent(context) - used - (after or 0.0)


def _returns_on_failure(context: RuleContext) -> bool:
    return context.plan.contingency.on_drop_failure != "continue"


def _left(percent: float) -> str:
    return f"{percent:.0f} %" if percent > 0.0 else "nothing"


_SOURCE = "Ours; rates declared in WAYDROP_VEHICLE_PERFORMANCE, the charge from BATTERY_STATUS."
RULES = (
    Rule(
        "battery.reserve_at_home",
        Severity.ERROR,
        "Where the flight ends the highest of three must be left: the declared reserve, the plan's own, and the level "
        "at which the vehicle acts by itself.",
        _SOURCE,
        _left_at_home,
    ),
    Rule(
        "battery.reserve_at_drop",
        Severity.ERROR,
        "At each drop the reserve must outlast the longest hold and what the plan does if the drop fails: a return "
        "(on_drop_failure return or hold), else the rest of the plan.",
        _SOURCE,
        _left_at_drops,
    ),
    Rule(
        "battery.rate_unknown",
        Severity.WARNING,
        "No message of a vehicle tells what it takes from its battery in flight; undeclared, it is not checked.",
        _SOURCE,
        _rate_declared,
    ),
    Rule(
        "battery.charge_unknown",
        Severity.WARNING,
        "Without a charge a full battery is taken.",
        "BATTERY_STATUS.battery_remaining of -1, or never received.",
        _charge_known,
    ),
    Rule(
        "battery.no_action",
        Severity.WARNING,
        "With COM_LOW_BAT_ACT 0 the vehicle flies on until its battery is empty.",
        "PX4 COM_LOW_BAT_ACT, default 0.",
        _acts_by_itself,
    ),
)
