"""Predicts a flight: the same walk that the rules check, with times."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from app.domain.autopilot import behaviour
from app.domain.items import ReturnToLaunch
from app.domain.plan.compiler import braking_at, holds_apart, mission_seqs, settle_s
from app.domain.plan.document import Plan
from app.domain.plan.drops import Detour, DropUse, drops_of, over_alternates
from app.domain.plan.walk import Step, cruise_speed_m_s, reference_home, return_speed_m_s, speeds_along, walk
from app.domain.prediction import rotary, vtol
from app.domain.prediction.durations import Ahead, effort, flown_order, point_of
from app.domain.prediction.energy import used_percent
from app.domain.prediction.motion import CALM, Effort, FlightContext, MotionState, Point, Wind, flight_of
from app.domain.prediction.path_return import LegPassage, is_unsure_path, positions_of
from app.domain.prediction.release import predicted_drop
from app.domain.prediction.timeline import PredictedAlternate, PredictedDrop, Timeline, TimelineEntry
from app.domain.vehicle.state import FlightRegime, VehicleProfile, carried_in_flight


def with_alternates(meant: Timeline, detour: Detour, over: Timeline, seqs_of: Mapping[str, Sequence[int]]) -> Timeline:
    """Return the timeline of the plan, with its alternates. `over` is the timeline of the detour's plan."""
    found = []
    for item_id, drop_id in detour.drops.items():
        visits = [entry for entry in over.entries if entry.item_id == item_id]
        if visits:
            found.append(
                PredictedAlternate(
                    item_id=item_id,
                    drop_id=drop_id,
                    seqs=tuple(seqs_of.get(item_id, ())),
                    latitude_deg=visits[0].latitude_deg,
                    longitude_deg=visits[0].longitude_deg,
                    relative_altitude_m=visits[0].relative_altitude_m,
                    distance_m=sum(entry.distance_m for entry in visits),
                    duration_s=sum(entry.duration_s for entry in visits),
                )
            )
    return meant.model_copy(update={"alternates": tuple(found), "longest_duration_s": over.duration_s})


_RETURN = ReturnToLaunch(type="return_to_launch")


def way_home_percent(
    flight: FlightContext, there: MotionState, drop: DropUse, ahead: Ahead, asked_m_s: float | None = None
) -> float | None:
    """A return from a drop, of a full battery, by the RTL settings; None if no rate is declared. `asked_m_s` is the
    speed of the plan there.
    """
    if flight.facts.performance is None:
        return None
    after = FlightRegime.WHEELS if drop.carried is FlightRegime.WHEELS else FlightRegime.GROUND
    step = replace(drop.step, item=_RETURN, before=drop.carried, after=after)
    flies = FlightRegime.ROTARY_WING if drop.carried is FlightRegime.GROUND else drop.carried
    speed_m_s = return_speed_m_s(flight.facts, flies, asked_m_s)
    took = effort(flight, there, step, speed_m_s, None, ahead)
    return used_percent(flight.facts, there, step, took, speed_m_s)


AFTER_UNSURE_S, AFTER_UNSURE_EXTRA_S = 1.0, 4.0
"""After an item of unsure time the next begins elsewhere than predicted: it takes longer, and that is unsure too."""


@dataclass(frozen=True, slots=True)
class Prediction:
    """`timeline` is that of the plan, `over` that of the flight over its alternates, if it has any."""

    timeline: Timeline
    over: Timeline | None = None


def predict(plan: Plan, facts: VehicleProfile, wind: Wind = CALM) -> Timeline:
    """The timeline of a plan for a vehicle with these facts. Works for plans with errors too, as far as they go."""
    return predict_all(plan, facts, wind, *_walked(plan, facts)).timeline


def predict_all(
    plan: Plan, facts: VehicleProfile, wind: Wind, steps: Sequence[Step], seqs_of: Mapping[str, Sequence[int]]
) -> Prediction:
    """As `predict`, with the flight over the alternates. `steps` are the walk in the order of the plan, `seqs_of`
    the mission items of its items (mission_seqs).
    """
    facts = behaviour(facts).usable()
    timeline = _timeline(plan, facts, wind, steps, seqs_of)
    detour = over_alternates(plan, reference_home(plan, facts), facts.in_flight)
    if detour is None:
        return Prediction(timeline)
    over = _timeline(detour.plan, facts, wind, *_walked(detour.plan, facts))
    return Prediction(with_alternates(timeline, detour, over, seqs_of), over)


def _walked(plan: Plan, facts: VehicleProfile) -> tuple[Sequence[Step], Mapping[str, Sequence[int]]]:
    steps = walk(plan, reference_home(plan, facts), in_flight=facts.in_flight)
    return steps, mission_seqs(plan, facts, steps)


def _timeline(
    plan: Plan, facts: VehicleProfile, wind: Wind, steps: Sequence[Step], seqs_of: Mapping[str, Sequence[int]]
) -> Timeline:
    flight = flight_of(plan, facts, wind)
    order = flown_order(plan)
    if order.indexes != tuple(range(len(steps))):
        steps = walk(plan, flight.home, order.indexes, facts.in_flight)
    entries, drops = _flown(flight, plan, steps, seqs_of)
    used = [entry.battery_used_percent for entry in entries if entry.battery_used_percent is not None]
    return Timeline(
        entries=tuple(entries),
        drops=tuple(drops),
        order=tuple(entry.item_id for entry in entries),
        distance_m=sum(entry.distance_m for entry in entries),
        duration_s=entries[-1].end_s if entries else 0.0,
        open_ended=order.open_ended,
        truncated=order.truncated,
        wind=wind,
        battery_start_percent=facts.battery_percent,
        battery_used_percent=sum(used) if used else None,
    )


def _flown(
    flight: FlightContext, plan: Plan, steps: Sequence[Step], seqs_of: Mapping[str, Sequence[int]]
) -> tuple[list[TimelineEntry], list[PredictedDrop]]:
    """Item after item, each from where and as the one before it ended."""
    speeds = speeds_along(plan, flight.facts, steps)
    drops = {id(drop.step): drop for drop in drops_of(steps)}
    braking = {id(anchor): drop for anchor, drop in braking_at(drops.values())}
    looks_ahead = _ahead(flight, steps, cache(lambda: positions_of(flight, plan)))
    entries: list[TimelineEntry] = []
    found: list[PredictedDrop] = []
    visits: dict[str, int] = {}
    begins = _begins(flight)
    now_s, motion, anchored, was_unsure = 0.0, begins, begins, False
    for number, (step, speed_m_s) in enumerate(zip(steps, speeds, strict=True)):
        visit = visits[step.item.id] = visits.get(step.item.id, 0) + 1
        drop = drops.get(id(step)) or braking.get(id(step))
        before_m_s = speeds[number - 1] if number else _asked_m_s(flight.facts)
        fly_m_s = speed_m_s or before_m_s or _own_m_s(flight.facts, step)  # a landing flies at the speed before it
        took = effort(flight, motion, step, fly_m_s, drop, looks_ahead[number])
        if step.item.goes_home and is_unsure_path(flight.facts):
            took = took._replace(uncertainty_s=took.uncertainty_s + now_s)
        if took.distance_m > 0.0:
            took, was_unsure = _after_unsure(took) if was_unsure else took, took.uncertainty_s > 0.0
            more_s = vtol.uncertainty_s(flight, step) + rotary.wind_uncertainty_s(flight, step, took, fly_m_s)
            if more_s > 0.0:
                took = took._replace(uncertainty_s=took.uncertainty_s + more_s)
        brakes = _brakes(step, drop, steps[number + 1] if number + 1 < len(steps) else None)
        seqs = tuple(seqs_of.get(step.item.id, ()))
        used = used_percent(flight.facts, motion, step, took, fly_m_s)
        entries.append(_entry(flight, step, seqs, visit, now_s, took, fly_m_s, brakes, used))
        anchored = took.end if step.anchor == step.index else anchored
        if drop is not None and drop.step is step and drop.anchor is not None:
            home = way_home_percent(flight, took.end, drop, looks_ahead[number], speed_m_s or None)
            at_s = now_s + took.duration_s - settle_s(drop.item, flight.facts) if _brakes_late(drop) else now_s
            found.append(predicted_drop(flight, drop, drop.anchor, visit, at_s, anchored, home))
        now_s, motion = now_s + took.duration_s, took.end
    return entries, found


def _brakes_late(drop: DropUse) -> bool:
    """The time of an embedded drop begins with its own hold, before the release."""
    return not drop.supervised and holds_apart(drop)


def _asked_m_s(facts: VehicleProfile) -> float:
    """The last commanded speed of a vehicle in flight; 0: none."""
    return 0.0 if facts.in_flight is None else facts.in_flight.asked_speed_m_s or 0.0


def _own_m_s(facts: VehicleProfile, step: Step) -> float:
    """Its speed without a command; on the ground, the speed after takeoff."""
    grounded = step.before is FlightRegime.GROUND
    return cruise_speed_m_s(facts, carried_in_flight(facts.vehicle_type) if grounded else step.before)


def _begins(flight: FlightContext) -> MotionState:
    """At home on the ground, or as it flies."""
    now = flight.facts.in_flight
    if now is None:
        return MotionState()
    course_rad = None if now.course_deg is None or now.ground_speed_m_s <= 0.0 else math.radians(now.course_deg)
    point = flight.to_local(now.latitude_deg, now.longitude_deg)
    return MotionState(point, now.relative_altitude_m, now.ground_speed_m_s, course_rad, course_rad)


def _after_unsure(took: Effort) -> Effort:
    return took._replace(
        duration_s=took.duration_s + AFTER_UNSURE_S, uncertainty_s=took.uncertainty_s + AFTER_UNSURE_EXTRA_S
    )


def _ahead(flight: FlightContext, steps: Sequence[Step], positions: Callable[[], Sequence[LegPassage]]) -> list[Ahead]:
    """For each step, in reverse: PX4 considers the next position item, and none beyond a takeoff."""
    found: list[Ahead] = []
    following: Point | None = None
    up_m = 0.0
    first_landing = next(
        (number for number, step in enumerate(steps) if step.item.is_stop and step.item.lands), len(steps)
    )
    for number, step in reversed(list(enumerate(steps))):
        found.append(Ahead(following, up_m, positions, has_landed=number > first_landing))
        if step.item.takes_off or step.item.goes_home:
            following = None
        elif step.item.is_stop:
            following, up_m = point_of(flight, step.end), step.end.relative_altitude_m
    return found[::-1]


def _entry(
    flight: FlightContext,
    step: Step,
    seqs: tuple[int, ...],
    visit: int,
    start_s: float,
    took: Effort,
    speed_m_s: float,
    brakes: bool,
    percent: float | None,
) -> TimelineEntry:
    performance = flight.facts.performance
    latitude_deg, longitude_deg = step.end.latitude_deg, step.end.longitude_deg
    if step.item.goes_home:
        latitude_deg, longitude_deg = flight.to_global(took.end.point)
    return TimelineEntry.model_validate(
        {
            "item_id": step.item.id,
            "type": step.item.type,
            "visit": visit,
            "seqs": seqs,
            "start_s": start_s,
            "end_s": start_s + took.duration_s,
            "duration_s": took.duration_s,
            "distance_m": took.distance_m,
            "ground_speed_m_s": speed_m_s if took.distance_m > 0 else 0.0,
            "latitude_deg": latitude_deg,
            "longitude_deg": longitude_deg,
            "relative_altitude_m": step.end.relative_altitude_m,
            "brakes": brakes,
            "uncertainty_s": took.uncertainty_s,
            "battery_used_percent": percent,
            "energy_wh": None if percent is None or performance is None else performance.wh(percent),
        }
    )


def _brakes(step: Step, drop: DropUse | None, following: Step | None) -> bool:
    """Whether the vehicle stops at the end of the item."""
    if step.item.lands:
        return True
    if step.item.circles():
        return step.after is FlightRegime.ROTARY_WING
    if not step.item.is_stop:
        return False
    if step.after is FlightRegime.ROTARY_WING:
        return drop is not None or step.item.hovers_s() > 0.0
    return step.after is FlightRegime.WHEELS and following is not None and following.item.waits
