"""Rules for the declared performance of a vehicle: battery and payload."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.plan.compiler import bound_s
from app.domain.plan.drops import DropUse
from app.domain.prediction import PredictedDrop
from app.domain.rules.registry import RuleContext, RuleSet, Violation, at_item
from app.domain.vehicle.performance import Performance, Phase

rules = RuleSet()
_BATTERY_SOURCE = "Waydrop; rates declared in WAYDROP_VEHICLE_PERFORMANCE, charge from BATTERY_STATUS."
_PAYLOAD_SOURCE = "Waydrop; declared in WAYDROP_VEHICLE_PERFORMANCE."

FULL_PERCENT = 100.0


@rules.error(
    "battery.reserve_at_home",
    "At the end of the flight, the highest of three reserves must be left: the declared one, the plan's, and the "
    "level at which the vehicle acts by itself.",
    _BATTERY_SOURCE,
)
def _left_at_home(context: RuleContext) -> Iterator[Violation]:
    performance = _performance(context)
    if performance is None:
        return
    used = context.timeline().battery_used_percent or 0.0
    reserve, why = _reserve(context, performance)
    start, left = _start_percent(context), _start_percent(context) - used
    if left < reserve:
        message = (
            f"the flight takes {used:.0f} % of the battery and starts with {start:.0f} %: {_left(left)} is left at the "
            f"end, less than the required {reserve:g} % ({why})"
        )
        yield at_item(
            context.steps[-1], message, "charge or replace the battery, shorten the flight, or split the plan"
        )


@rules.error(
    "battery.reserve_at_drop",
    "At each drop, the reserve must cover the longest hold and what the plan specifies for a failed drop: a return "
    "(on_drop_failure return or hold), else the rest of the plan.",
    _BATTERY_SOURCE,
)
def _left_at_drops(context: RuleContext) -> Iterator[Violation]:
    performance = _performance(context)
    if performance is None:
        return
    reserve, why = _reserve(context, performance)
    drops = {drop.item.id: drop for drop in context.drops}
    reported: set[str] = set()
    for predicted in context.timeline().drops:
        drop = drops[predicted.item_id]
        left = _left_after_worst(context, performance, drop, predicted)
        if left < reserve and predicted.item_id not in reported:
            reported.add(predicted.item_id)
            how = "the return" if _returns_on_failure(context) else "the rest of the plan"
            message = f"after the longest hold here and {how}, {_left(left)} is left, less than {reserve:g} % ({why})"
            yield at_item(drop.step, message, "reduce hold_s, drop closer to home, or charge the battery")


@rules.warning(
    "battery.rate_unknown",
    "No message reports the energy consumption in flight. Without a declaration it is not checked.",
    _BATTERY_SOURCE,
)
def _rate_declared(context: RuleContext) -> Iterator[Violation]:
    if context.vehicle is not None and _performance(context) is None:
        message = "the energy consumption of this vehicle is not declared, so its battery is not checked"
        yield Violation("", message, "declare it in WAYDROP_VEHICLE_PERFORMANCE")


@rules.warning(
    "battery.charge_unknown",
    "Without a reported charge, a full battery is assumed.",
    "BATTERY_STATUS.battery_remaining of -1, or never received.",
)
def _charge_known(context: RuleContext) -> Iterator[Violation]:
    if context.vehicle is not None and _performance(context) is not None and context.facts.battery_percent is None:
        message = "the vehicle does not report its battery charge; a full battery is assumed"
        yield Violation("", message, "check the battery before the start, or enable BATTERY_STATUS")


@rules.warning(
    "battery.no_action",
    "With COM_LOW_BAT_ACT 0, the vehicle flies until its battery is empty.",
    "PX4 COM_LOW_BAT_ACT, default 0.",
)
def _acts_by_itself(context: RuleContext) -> Iterator[Violation]:
    if context.vehicle is None:
        return
    low = context.behaviour.low_battery
    if low.only_warns:
        message = f"the vehicle only warns when its battery is nearly empty ({low.setting})"
        yield Violation("", message, low.setting.remedy)


def _performance(context: RuleContext) -> Performance | None:
    performance = context.facts.performance
    return performance if performance is not None and performance.has_energy_rates else None


def _start_percent(context: RuleContext) -> float:
    charge = context.facts.battery_percent
    return FULL_PERCENT if charge is None else charge


def _reserve(context: RuleContext, performance: Performance) -> tuple[float, str]:
    """Return the highest required reserve, and which setting requires it."""
    asked = [(performance.reserve_percent, "the vehicle's reserve_percent")]
    if context.plan.limits.min_battery_percent is not None:
        asked.append((context.plan.limits.min_battery_percent, "limits.min_battery_percent"))
    acts_below = context.behaviour.low_battery.acts_below
    if acts_below is not None:
        asked.append((acts_below.value, f"{acts_below.name}: below it the vehicle returns or lands by itself"))
    return max(asked)


def _left_after_worst(context: RuleContext, performance: Performance, drop: DropUse, predicted: PredictedDrop) -> float:
    """Assume that the whole hold is used and the drop fails, then what the plan specifies for a failed drop."""
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


_TAKES = frozenset({"grab", "load_line", "load_payload"})


@rules.error(
    "payload.too_heavy",
    "The load may not exceed the declared payload, from the start or from a grab on.",
    _PAYLOAD_SOURCE,
)
def _within_payload(context: RuleContext) -> Iterator[Violation]:
    most_kg = _most_kg(context)
    if most_kg is None:
        return
    carried = _at_start(context.drops)
    broken = _too_heavy(sum(carried.values()), most_kg)
    if broken:
        heaviest = max(_first_releases(context.drops), key=lambda drop: drop.item.mass_kg or 0.0)
        yield at_item(heaviest.step, broken, "use another vehicle, or two flights", "mass_kg")
    for drop in context.drops:
        device = drop.item.type
        if drop.releases:
            carried[device] = 0.0
        elif drop.item.action in _TAKES:
            carried[device] = _taken_kg(context.drops, drop)
            broken = _too_heavy(sum(carried.values()), most_kg)
            if broken:
                yield at_item(drop.step, broken, "use another vehicle, or a lighter parcel", "mass_kg")


@rules.warning(
    "payload.mass_unknown", "A parcel without mass_kg is not checked against the declared payload.", _PAYLOAD_SOURCE
)
def _mass_given(context: RuleContext) -> Iterator[Violation]:
    if _most_kg(context) is None:
        return
    for drop in context.drops:
        if drop.releases and drop.item.mass_kg is None:
            message = "the mass of the parcel is unknown, so it is not checked against the payload of the vehicle"
            yield at_item(drop.step, message, "set mass_kg")


@rules.warning(
    "payload.limit_unknown",
    "mass_kg is not checked if no payload is declared, because no message reports the payload.",
    _PAYLOAD_SOURCE,
)
def _payload_declared(context: RuleContext) -> Iterator[Violation]:
    if context.vehicle is None or _most_kg(context) is not None:
        return
    given = next((drop for drop in context.drops if drop.item.mass_kg is not None), None)
    if given is not None:
        message = f"the payload of this vehicle is not declared: {given.item.mass_kg:g} kg is not checked"
        yield at_item(given.step, message, "set payload_max_kg for it in WAYDROP_VEHICLE_PERFORMANCE", "mass_kg")


def _most_kg(context: RuleContext) -> float | None:
    performance = context.facts.performance
    return None if performance is None else performance.payload_max_kg


def _at_start(drops: tuple[DropUse, ...]) -> dict[str, float]:
    """Return the load of each device at takeoff: the first parcel that it releases, unless it grabs it first."""
    carried: dict[str, float] = {drop.item.type: 0.0 for drop in drops}
    for drop in _first_releases(drops):
        carried[drop.item.type] = drop.item.mass_kg or 0.0
    return carried


def _first_releases(drops: tuple[DropUse, ...]) -> list[DropUse]:
    begun: dict[str, DropUse] = {}
    for drop in drops:
        if drop.releases or drop.item.action in _TAKES:
            begun.setdefault(drop.item.type, drop)
    return [drop for drop in begun.values() if drop.releases]


def _taken_kg(drops: tuple[DropUse, ...], grab: DropUse) -> float:
    """Return its own mass_kg, else that of the release that follows it."""
    if grab.item.mass_kg is not None:
        return grab.item.mass_kg
    for drop in drops[drops.index(grab) + 1 :]:
        if drop.releases and drop.item.type == grab.item.type:
            return drop.item.mass_kg or 0.0
    return 0.0


def _too_heavy(load_kg: float, most_kg: float) -> str:
    return f"the load is {load_kg:g} kg; the vehicle may carry {most_kg:g} kg" if load_kg > most_kg else ""
