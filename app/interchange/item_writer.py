"""Plan items as the mission items of a file: what an autopilot does with them is what the plan means.

A drop is written as an item of the mission with all that makes it work there: the hold and the radius that stop a
rotary wing at its waypoint, the time that the gripper needs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from app.domain.autopilot.declared import default_facts
from app.domain.items import FORMS, Delay, Land, PlanItem
from app.domain.items.fields import Altitude
from app.domain.items.landing_pattern import LandingPattern, landing_pattern
from app.domain.mission import MavCmd, MavFrame
from app.domain.plan import Plan
from app.domain.plan.compiler import EMBEDDED_HOLD_S, settle_s, stop_radius_m
from app.domain.plan.drops import DropUse, drops_of
from app.domain.plan.walk import Step, walk
from app.domain.prediction.durations import COMES_TO_REST_S
from app.domain.vehicle.state import FlightRegime, GlobalPosition, VehicleType
from app.interchange.item_draft import FileItem, ItemExtra
from app.interchange.item_reader import speed_kind

_BEFORE_DROP_S: Final = 1.0
"""Stops what only a NAV_DELAY stops: a rover, a vehicle on the ground."""


@dataclass(frozen=True, slots=True)
class WrittenItem:
    """The mission items of one plan item. `main` is the index of the one that carries its id."""

    items: tuple[FileItem, ...]
    main: int


def write_items(plan: Plan, home: GlobalPosition) -> tuple[WrittenItem, ...]:
    """All items, numbered from 1 as QGroundControl does. Jumps point at the first item of their target."""
    steps = walk(plan, home)
    drops = {drop.step.index: drop for drop in drops_of(steps)}
    braking = {drop.anchor.index for drop in drops.values() if drop.anchor is not None and _stops_at_waypoint(drop)}
    made: list[WrittenItem] = []
    number = 1
    first: dict[str, float] = {}
    for step in steps:
        written = _write(plan, step, drops.get(step.index), step.index in braking, home)
        items = tuple(replace(item, number=number + index) for index, item in enumerate(written.items))
        first[step.item.id] = float(number)
        number += len(items)
        made.append(WrittenItem(items, written.main))
    return tuple(_with_target(item, step.item, first) for item, step in zip(made, steps, strict=True))


def _stops_at_waypoint(drop: DropUse) -> bool:
    """The waypoint of this drop must brake, whoever commands the drop and whatever is waited for before it."""
    return (
        drop.anchor is not None
        and drop.anchor.item.holds()
        and drop.first
        and drop.stopped
        and drop.carried is FlightRegime.ROTARY_WING
    )


def _write(plan: Plan, step: Step, drop: DropUse | None, braking: bool, home: GlobalPosition) -> WrittenItem:
    before: list[FileItem] = []
    after: list[FileItem] = []
    item = step.item
    fields = item.model_dump(exclude_none=True)
    fields |= item.written_fields(plan.vehicle_type, home)
    if item.takes_off:
        after += _speed_item(plan.cruise_speed_m_s, plan.vehicle_type, "cruise_speed")
    elif item.is_stop:
        before += _speed_item(item.asked_speed_m_s(), plan.vehicle_type, "speed")
    if braking:
        hold_s, radius_m = max(EMBEDDED_HOLD_S, item.hovers_s()), stop_radius_m(item.reach_m())
        fields |= {"hold_s": hold_s, "acceptance_radius_m": radius_m}
    if isinstance(item, Land) and plan.vehicle_type is VehicleType.FIXED_WING:
        before += _landing_items(item, step, home)
    if drop is not None:
        following = plan.items[step.index + 1] if step.index + 1 < len(plan.items) else None
        before, after = _around_drop(drop, following)
    if step.index == 0 and plan.vehicle_type is VehicleType.ROVER:
        before = [*_speed_item(plan.cruise_speed_m_s, plan.vehicle_type, "cruise_speed"), *before]
    main = _item(item.command(plan.vehicle_type), fields, ItemExtra("", id=item.id))
    return WrittenItem((*before, main, *after), len(before))


def _item(command: MavCmd, fields: Mapping[str, Any], extra: ItemExtra | None = None) -> FileItem:
    """An item whose parameters are the fields of its form."""
    form = FORMS[command]
    params: list[float | None] = [0.0] * 7
    for number, values in form.neutral.items():
        params[number - 1] = values[0]
    for name, param in form.params.items():
        params[param.number - 1] = None if name == "target" else param.written(fields.get(name))
    frame = MavFrame.MISSION
    if form.positioned:
        relative_m = fields.get("relative_altitude_m")
        frame = MavFrame.GLOBAL if relative_m is None else MavFrame.GLOBAL_RELATIVE_ALT
        altitude_m = fields.get("absolute_altitude_m") if relative_m is None else relative_m
        params[4:7] = fields.get("latitude_deg"), fields.get("longitude_deg"), altitude_m
    return FileItem(command, frame, tuple(params), 0, "", extra=extra)


def _speed_item(speed_m_s: float | None, vehicle_type: VehicleType, role: str) -> list[FileItem]:
    if speed_m_s is None:
        return []
    words = FORMS[MavCmd.DO_CHANGE_SPEED].params["speed_type"].words or {}
    fields = {"speed_m_s": speed_m_s, "speed_type": words[speed_kind(vehicle_type)]}
    return [_item(MavCmd.DO_CHANGE_SPEED, fields, ItemExtra("", role=role))]


def _wait(duration_s: float, role: str) -> FileItem:
    extra = ItemExtra("", role=role, written={"duration_s": duration_s})
    return _item(MavCmd.NAV_DELAY, {"duration_s": duration_s}, extra)


def _around_drop(drop: DropUse, following: PlanItem | None) -> tuple[list[FileItem], list[FileItem]]:
    """The waits that a stopped drop needs before and after it: PX4 itself goes on at once."""
    if not drop.stopped:
        return [], []
    pause_s = _pause_s(drop)
    settle = settle_s(drop.item, default_facts(VehicleType.MULTICOPTER))
    waits = isinstance(following, Delay) and following.duration_s >= settle
    return ([_wait(pause_s, "pause")] if pause_s else []), ([] if waits else [_wait(settle, "wait")])


def _pause_s(drop: DropUse) -> float:
    if not drop.first:
        return 0.0
    if drop.carried is FlightRegime.ROTARY_WING:
        return 0.0 if _stops_at_waypoint(drop) else COMES_TO_REST_S
    return _BEFORE_DROP_S if drop.supervised else 0.0


def _landing_items(item: Land, step: Step, home: GlobalPosition) -> list[FileItem]:
    """DO_LAND_START and the circle: the plan's own, or the one that Waydrop would fly."""
    start = FileItem(MavCmd.DO_LAND_START, MavFrame.MISSION, (0.0,) * 7, 0, "")
    pattern = landing_pattern(item, item.approach, step.start, home, default_facts(VehicleType.FIXED_WING))
    given: Altitude = item.approach or item
    relative = given.absolute_altitude_m is None
    frame = MavFrame.GLOBAL_RELATIVE_ALT if relative else MavFrame.GLOBAL
    params = (1.0, _radius_m(item, pattern), 0.0, 1.0, *_circle(item, pattern, 0.0 if relative else home.altitude_m))
    return [start, FileItem(MavCmd.NAV_LOITER_TO_ALT, frame, params, 0, "")]


def _radius_m(item: Land, pattern: LandingPattern) -> float:
    return pattern.radius_m if item.approach is None else item.approach.radius_m


def _circle(item: Land, pattern: LandingPattern, zero_m: float) -> tuple[float, float, float]:
    """As given, with all digits; else as computed."""
    approach = item.approach
    if approach is None:
        circle = pattern.circle
        return circle.latitude_deg, circle.longitude_deg, circle.relative_altitude_m + zero_m
    altitude_m = approach.relative_altitude_m
    return (
        approach.latitude_deg,
        approach.longitude_deg,
        altitude_m if altitude_m is not None else approach.absolute_altitude_m or 0.0,
    )


def _with_target(written: WrittenItem, item: PlanItem, first: Mapping[str, float]) -> WrittenItem:
    """param1 of a jump; null if its target is no item of the plan."""
    if (target := item.jumps_to()) is None:
        return written
    items = list(written.items)
    jump = items[written.main]
    items[written.main] = replace(jump, params=(first.get(target), *jump.params[1:]))
    return WrittenItem(tuple(items), written.main)
