"""One plan on one simulated vehicle, predicted and flown, and how far apart the two are."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from app.domain.geo import distance_m
from app.domain.mission import Mission
from app.domain.plan import Plan
from app.domain.plan.compiler import compile_plan
from app.domain.prediction import PredictedDrop, Timeline, Wind, predict
from app.domain.vehicle.state import VehicleType
from app.simulator.params import Value
from bench.flown_mission import FlownMission, Released, SimulatedFlight

AIRFRAMES = {
    VehicleType.MULTICOPTER: ("quad", "hexa"),
    VehicleType.FIXED_WING: ("plane",),
    VehicleType.VTOL: ("vtol",),
    VehicleType.ROVER: ("rover",),
    VehicleType.AIRSHIP: ("airship",),
}
SHARE = 0.15
FLOOR_S = 1.0
"""A link shows the current item once a second: nothing shorter is told apart in a real flight."""
RELEASE_M = 3.0


@dataclass(frozen=True, slots=True)
class ItemRow:
    """One visit of an item. `flown_s` is None if it was not flown."""

    item_id: str
    type: str
    visit: int
    predicted_s: float
    flown_s: float | None
    uncertainty_s: float

    @property
    def difference(self) -> float | None:
        """Share of the flown time by which the prediction is off."""
        if self.flown_s is None or self.flown_s < 0.05:
            return None
        return (self.predicted_s - self.flown_s) / self.flown_s

    @property
    def is_within(self) -> bool:
        """15 % of the flown time, a second for a short item, and what the prediction itself called unsure."""
        if self.flown_s is None:
            return False
        return abs(self.predicted_s - self.flown_s) <= max(SHARE * self.flown_s, FLOOR_S) + self.uncertainty_s


@dataclass(frozen=True, slots=True)
class DropRow:
    """One release. `apart_m` is from the predicted place; on a circle, from the predicted distance to its centre."""

    item_id: str
    lead_m: float
    apart_m: float | None
    bound_m: float

    @property
    def is_within(self) -> bool:
        """Inside the bound for the vehicle's type."""
        return self.apart_m is not None and self.apart_m <= self.bound_m


@dataclass(frozen=True, slots=True)
class PredictedFlight:
    """The rows of one flight. `predicted_s` and `flown_s` are from the start to the end."""

    items: tuple[ItemRow, ...]
    drops: tuple[DropRow, ...]
    predicted_s: float
    flown_s: float | None

    @property
    def failures(self) -> tuple[str, ...]:
        """What is out of bounds, in words."""
        items = [
            f"{row.item_id} takes {row.flown_s} s, not {row.predicted_s:.1f}" for row in self.items if not row.is_within
        ]
        drops = [f"{row.item_id} is released {row.apart_m} m away" for row in self.drops if not row.is_within]
        total = [] if self.flown_s is not None else ["it did not end"]
        return (*items, *drops, *total)


def predicted_and_flown(
    plan: Plan,
    airframe: str,
    *,
    wind_m_s: tuple[float, float] = (0.0, 0.0),
    params: dict[str, Value] | None = None,
) -> PredictedFlight:
    """Predict with the vehicle's own parameters (and the wind), fly, compare. RuntimeError if it does not start."""
    winch = any(item.type == "winch" for item in plan.items)
    flight = SimulatedFlight(airframe, wind_m_s=wind_m_s, params=params, winch=winch)
    facts = flight.facts(plan)
    timeline = predict(plan, facts, Wind(*wind_m_s))
    mission = compile_plan(plan, facts)
    flown = flight.fly(plan)
    return PredictedFlight(
        items=_items(timeline, mission, flown),
        drops=_drops(plan, timeline, mission, flown),
        predicted_s=timeline.duration_s,
        flown_s=flown.ended_s,
    )


def _items(timeline: Timeline, mission: Mission, flown: FlownMission) -> tuple[ItemRow, ...]:
    times = _visit_times(mission, flown)
    return tuple(
        ItemRow(
            item_id=entry.item_id,
            type=entry.type,
            visit=entry.visit,
            predicted_s=entry.duration_s,
            flown_s=times.get((entry.item_id, entry.visit)),
            uncertainty_s=entry.uncertainty_s,
        )
        for entry in timeline.entries
    )


def _visit_times(mission: Mission, flown: FlownMission) -> dict[tuple[str, int], float]:
    """Seconds of each visit of each plan item."""
    holds = {drop.hold_seqs[-1]: drop.plan_item_id for drop in mission.drops if drop.supervised}
    visits: Counter[str] = Counter()
    times: dict[tuple[str, int], float] = {}
    began_s = 0.0
    for index, (seq, at_s) in enumerate(flown.item_ends):
        item_id = mission.plan_item_of[seq]
        following = flown.item_ends[index + 1] if index + 1 < len(flown.item_ends) else None
        if following is not None and following[0] == seq + 1 and mission.plan_item_of[following[0]] == item_id:
            continue
        end_s = at_s if following is not None or flown.ended_s is None else flown.ended_s
        drop_id = holds.get(seq)
        parts = [(item_id, end_s)]
        if drop_id is not None and drop_id != item_id:
            ordered_s = min(flown.ordered_s.get(drop_id, end_s), end_s)
            parts = [(item_id, ordered_s), (drop_id, end_s)]
        for part, part_s in parts:
            visits[part] += 1
            times[part, visits[part]] = part_s - began_s
            began_s = part_s
    return times


def _drops(plan: Plan, timeline: Timeline, mission: Mission, flown: FlownMission) -> tuple[DropRow, ...]:
    releasing = {drop.plan_item_id for drop in mission.drops}
    predicted = [drop for drop in timeline.drops if drop.item_id in releasing]
    rows: list[DropRow] = []
    for index, drop in enumerate(predicted):
        released = flown.releases[index] if index < len(flown.releases) else None
        compiled = next(one for one in mission.drops if one.plan_item_id == drop.item_id)
        centre = (compiled.latitude_deg, compiled.longitude_deg)
        apart_m = None if released is None else _apart_m(drop, released, centre)
        wing = plan.vehicle_type is VehicleType.FIXED_WING
        bound_m = max(SHARE * (drop.lead_m or drop.offset_m), 0.5) if wing else RELEASE_M
        rows.append(DropRow(drop.item_id, drop.lead_m, apart_m, bound_m))
    return tuple(rows)


def _apart_m(drop: PredictedDrop, released: Released, centre: tuple[float, float]) -> float:
    there = (released.latitude_deg, released.longitude_deg)
    if drop.release_latitude_deg is None or drop.release_longitude_deg is None:
        return abs(distance_m(*centre, *there) - drop.offset_m)
    return distance_m(drop.release_latitude_deg, drop.release_longitude_deg, *there)
