"""Rules for what a vehicle carries: the parcels of the plan against the payload that is declared for it."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.finding import Severity
from app.domain.plan.drops import DropUse
from app.domain.rules.registry import Rule, RuleContext, Violation, at_item

_TAKES = frozenset({"grab", "load_line", "load_payload"})


def _within_payload(context: RuleContext) -> Iterator[Violation]:
    most_kg = _most_kg(context)
    if most_kg is None:
        return
    carried = _at_start(context.drops)
    broken = _too_heavy(sum(carried.values()), most_kg)
    if broken:
        heaviest = max(_first_releases(context.drops), key=lambda drop: drop.item.mass_kg or 0.0)
        yield at_item(heaviest.step, broken, "take another vehicle, or fly twice", "mass_kg")
    for drop in context.drops:
        device = drop.item.type
        if drop.releases:
            carried[device] = 0.0
        elif drop.item.action in _TAKES:
            carried[device] = _taken_kg(context.drops, drop)
            broken = _too_heavy(sum(carried.values()), most_kg)
            if broken:
                yield at_item(drop.step, broken, "take another vehicle, or a lighter parcel", "mass_kg")


def _mass_given(context: RuleContext) -> Iterator[Violation]:
    if _most_kg(context) is None:
        return
    for drop in context.drops:
        if drop.releases and drop.item.mass_kg is None:
            message = "the parcel's mass is not given, so it is not held against what the vehicle may carry"
            yield at_item(drop.step, message, "give mass_kg")


def _payload_declared(context: RuleContext) -> Iterator[Violation]:
    if context.vehicle is None or _most_kg(context) is not None:
        return
    given = next((drop for drop in context.drops if drop.item.mass_kg is not None), None)
    if given is not None:
        message = f"nobody declared what this vehicle may carry: {given.item.mass_kg:g} kg is not checked"
        yield at_item(given.step, message, "set payload_max_kg for it in WAYDROP_VEHICLE_PERFORMANCE", "mass_kg")


def _most_kg(context: RuleContext) -> float | None:
    performance = context.facts.performance
    return None if performance is None else performance.payload_max_kg


def _at_start(drops: tuple[DropUse, ...]) -> dict[str, float]:
    """What hangs on each device as the flight begins: the parcel that it first lets go, unless it takes it before."""
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
    """Its own mass_kg, else that of the release which follows it."""
    if grab.item.mass_kg is not None:
        return grab.item.mass_kg
    for drop in drops[drops.index(grab) + 1 :]:
        if drop.releases and drop.item.type == grab.item.type:
            return drop.item.mass_kg or 0.0
    return 0.0


def _too_heavy(load_kg: float, most_kg: float) -> str:
    return f"{load_kg:g} kg to carry; the vehicle may carry {most_kg:g} kg" if load_kg > most_kg else ""


_SOURCE = "Ours; declared in WAYDROP_VEHICLE_PERFORMANCE."
RULES = (
    Rule(
        "payload.too_heavy",
        Severity.ERROR,
        "A vehicle carries no more than its operator declares of it, from the start or from a grab on.",
        _SOURCE,
        _within_payload,
    ),
    Rule(
        "payload.mass_unknown",
        Severity.WARNING,
        "A parcel without mass_kg is not held against the declared payload.",
        _SOURCE,
        _mass_given,
    ),
    Rule(
        "payload.limit_unknown",
        Severity.WARNING,
        "A given mass_kg is held against nothing where no payload is declared; no message of a vehicle tells it.",
        _SOURCE,
        _payload_declared,
    ),
)
