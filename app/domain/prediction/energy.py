"""The battery use of items, from the rates that the operator declares for the vehicle.

Wind affects time: a fixed wing needs longer against it. For a hovering vehicle, consumption in wind is assumed equal to
calm air, and consumption after a drop equal to that before it: the declared rates are those of the loaded vehicle.
"""

from __future__ import annotations

from app.domain.autopilot import Quantity, quantity
from app.domain.plan.walk import Step
from app.domain.prediction import wing
from app.domain.prediction.motion import Effort, MotionState
from app.domain.prediction.rotary import takes_off_s
from app.domain.vehicle.performance import Phase
from app.domain.vehicle.state import FlightRegime, VehicleProfile, VehicleType


def used_percent(
    facts: VehicleProfile, before: MotionState, step: Step, took: Effort, speed_m_s: float
) -> float | None:
    """Percent of the full battery; None if no rate is declared. Time without climb or distance counts as hover."""
    performance = facts.performance
    if performance is None or not performance.has_energy_rates:
        return None
    climb_s = min(took.duration_s, _climb_s(facts, before, step, took))
    level_s = took.duration_s - climb_s
    cruise_s = level_s if _is_on_wing(facts, step) else min(level_s, took.distance_m / max(speed_m_s, 0.1))
    spent = {Phase.CLIMB: climb_s, Phase.CRUISE: cruise_s, Phase.HOVER: level_s - cruise_s}
    return sum(seconds * performance.percent_per_s(phase) for phase, seconds in spent.items())


def _climb_s(facts: VehicleProfile, before: MotionState, step: Step, took: Effort) -> float:
    rise_m = took.climbed_m if took.climbed_m is not None else max(0.0, took.end.up_m - before.up_m)
    if rise_m <= 0.0 or FlightRegime.WHEELS in (step.before, step.after):
        return 0.0
    if step.item.takes_off:
        return took.duration_s if facts.vehicle_type is VehicleType.FIXED_WING else takes_off_s(facts, rise_m)
    if _is_on_wing(facts, step):
        return wing.climb_s(facts, rise_m)
    return rise_m / max(quantity(facts, Quantity.CLIMB_M_S), 0.1)


def _is_on_wing(facts: VehicleProfile, step: Step) -> bool:
    if facts.vehicle_type is VehicleType.FIXED_WING:
        return True
    return step.before is FlightRegime.FIXED_WING and step.after is FlightRegime.FIXED_WING
