"""Hypothesis strategies: plans that can be read, sensible or not, and JSON that was damaged."""

from __future__ import annotations

import copy
from typing import Any

from hypothesis import strategies as st

from app.domain.plan import Plan, parse_plan
from app.domain.vehicle.state import FirmwareVersion, GlobalPosition, VehicleProfile, VehicleType
from tests.support.plan_pieces import Json, at, plan_json, square, takeoff

_NORTH = st.integers(-600, 600).map(float)
_ALTITUDE = st.sampled_from(
    [{"relative_altitude_m": height} for height in (-10, 0, 12, 30, 60)] + [{"absolute_altitude_m": 520.0}]
)
_ANYWHERE = st.fixed_dictionaries(
    {"latitude_deg": st.floats(-90, 90, allow_nan=False), "longitude_deg": st.floats(-180, 180, allow_nan=False)}
)
_NEARBY = st.builds(at, _NORTH, _NORTH)
_PLACE = st.one_of(_NEARBY, _NEARBY, _NEARBY, _ANYWHERE)
_MAYBE = st.none()
_DROP: dict[str, st.SearchStrategy[Any]] = {
    "release_motion": st.sampled_from(["stopped", "moving"]),
    "mode": st.sampled_from([None, "supervised", "embedded"]),
    "hold_s": st.floats(0.5, 600),
    "max_offset_m": st.none() | st.floats(0.5, 100),
    "instance": st.integers(1, 16),
    "consent": st.sampled_from(["none", "none", "operator"]),
    "consent_timeout_s": st.none() | st.floats(5, 600),
}


def _item(kind: str, **fields: st.SearchStrategy[Any]) -> st.SearchStrategy[Json]:
    return st.fixed_dictionaries({"type": st.just(kind), **fields})


def _positioned(kind: str, **fields: st.SearchStrategy[Any]) -> st.SearchStrategy[Json]:
    parts = st.tuples(_item(kind, **fields), _PLACE, _ALTITUDE)
    return parts.map(lambda part: part[0] | part[1] | part[2])


_APPROACH = st.tuples(_PLACE, _ALTITUDE, st.integers(-200, 200)).map(lambda p: p[0] | p[1] | {"radius_m": p[2]})
_LOITER_KIND: st.SearchStrategy[Json] = st.sampled_from(
    [
        {"kind": "time", "duration_s": 20},
        {"kind": "turns", "turns": 2},
        {"kind": "unlimited"},
        {"kind": "to_altitude"},
    ]
)
WAYPOINT = _positioned(
    "waypoint",
    hold_s=st.sampled_from([0, 5]),
    acceptance_radius_m=st.none() | st.floats(0.1, 50),
    yaw_deg=st.none() | st.floats(-360, 360),
    speed_m_s=st.none() | st.floats(0.5, 40),
)
LOITER = st.tuples(_positioned("loiter", radius_m=st.sampled_from([None, 60, -80])), _LOITER_KIND).map(
    lambda part: part[0] | part[1]
)
_TARGET = st.fixed_dictionaries(
    {"feed": st.just("ship-1"), "max_move_m": st.floats(1, 500), "max_speed_m_s": st.floats(0.5, 30)}
)
_TERMS = {name: _DROP[name] for name in ("hold_s", "max_offset_m", "consent", "consent_timeout_s")}
_ALTERNATE = st.tuples(_PLACE, _ALTITUDE, st.fixed_dictionaries(_TERMS)).map(lambda p: p[0] | p[1] | p[2])
GRIPPER = _item(
    "gripper",
    action=st.sampled_from(["release", "grab"]),
    alternate=st.none() | st.none() | _ALTERNATE,
    target=st.none() | st.none() | _TARGET,
    **_DROP,
)
ITEM = st.one_of(
    WAYPOINT,
    WAYPOINT,
    LOITER,
    GRIPPER,
    GRIPPER,
    _item("winch", action=st.sampled_from(["deliver", "retract"]), **_DROP),
    _item("delay", duration_s=st.floats(0.5, 60)),
    _item("change_speed", speed_m_s=st.floats(0.5, 40)),
    _item("transition", to=st.sampled_from(["fixed_wing", "multicopter"])),
    _positioned("land", approach=st.none() | _APPROACH),
    _item("return_to_launch"),
    _item("jump", target=st.integers(1, 8).map(lambda number: f"item-{number}"), repeats=st.integers(1, 4)),
    _positioned("takeoff"),
)
_SQUARE = st.builds(square, st.sampled_from(["inclusion", "exclusion"]), _NORTH, _NORTH, st.integers(1, 900).map(float))
_CORNERS = st.lists(_PLACE, min_size=3, max_size=6)
_RANDOM_POLYGON = _CORNERS.map(lambda corners: {"kind": "exclusion", "vertices": corners})
_FENCE = st.fixed_dictionaries({"polygons": st.lists(_SQUARE | _RANDOM_POLYGON, max_size=3)})
VEHICLE_TYPES = st.sampled_from([vehicle_type.value for vehicle_type in VehicleType])
_ITEMS = st.lists(ITEM, min_size=1, max_size=8)
_MORE = st.fixed_dictionaries(
    {"geofence": _FENCE, "cruise_speed_m_s": st.none() | st.floats(1, 30)},
    optional={"home": _MAYBE, "limits": st.just({"max_duration_s": 60})},
)


@st.composite
def plan_documents(draw: st.DrawFn) -> Json:
    """JSON that is a plan, of any sense; about half begin as a plan should."""
    first = [takeoff(15, **at(160, 0))] if draw(st.booleans()) else []
    items = first + draw(_ITEMS)
    return plan_json(draw(VEHICLE_TYPES), *items, **draw(_MORE))


PLANS: st.SearchStrategy[Plan] = plan_documents().map(parse_plan)


@st.composite
def sensible_plans(draw: st.DrawFn) -> Plan:
    """Plans most of which pass the rules: for laws about plans that are accepted."""
    vehicle_type = draw(VEHICLE_TYPES)
    stops = draw(_STOPS[vehicle_type])
    items: list[Json] = []
    action = "release"
    for place, kind in stops:
        items += _stop(kind, place, draw)
        if items[-1]["type"] == "gripper":
            items[-1]["action"] = action
            if action == "grab":
                items[-1]["mode"] = None  # a grab is never supervised
                items[-1].pop("alternate", None)
            action = "grab" if action == "release" else "release"
        if kind == "landed":
            items.append({"type": "waypoint", **place, "relative_altitude_m": 40})
    if vehicle_type == "vtol":
        items.insert(0, {"type": "transition", "to": "multicopter"})
    if vehicle_type != "rover":
        last = {"type": "waypoint", "relative_altitude_m": 20}  # an airship's crew takes over at the mast
        if vehicle_type != "airship":
            last = {"type": "land", "relative_altitude_m": 0}
        items = [takeoff(40, **at(160, 0)), *items, {**last, **at(0, 0)}]
    return parse_plan(plan_json(vehicle_type, *items))


_HOVERING = ["pass", "stopped", "moving", "loiter_stopped", "landed"]
_CIRCLING = ["pass", "moving", "loiter_moving"]
_KINDS_OF_STOPS = {
    "multicopter": _HOVERING,
    "vtol": _HOVERING,
    "fixed_wing": _CIRCLING,
    "airship": _CIRCLING,
    "rover": ["pass", "delayed", "moving"],
}
_STOPS = {
    vehicle_type: st.lists(st.tuples(_NEARBY, st.sampled_from(kinds)), min_size=1, max_size=5)
    for vehicle_type, kinds in _KINDS_OF_STOPS.items()
}
_STOPPED_MODES = st.sampled_from([None, "supervised", "embedded"])


def _stop(kind: str, place: Json, draw: st.DrawFn) -> list[Json]:
    """The items of one stop, by how it drops there."""
    position = {"type": "waypoint", **place, "relative_altitude_m": 40}
    if kind.startswith("loiter"):
        position |= {"type": "loiter", "kind": "time", "duration_s": 20}
    elif kind == "landed":
        position |= {"type": "land", "relative_altitude_m": 0}
    if kind == "pass":
        return [position]
    moving = kind.endswith("moving")
    mode = "embedded" if moving else draw(_STOPPED_MODES)
    drop = {"type": "gripper", "action": "release", "release_motion": "moving" if moving else "stopped", "mode": mode}
    if not moving and kind != "landed" and mode != "embedded" and draw(st.booleans()):
        drop["alternate"] = {**draw(_NEARBY), "relative_altitude_m": 40}
    return [position, *([{"type": "delay", "duration_s": 2}] if kind == "delayed" else []), drop]


def vehicle_facts(vehicle_type: VehicleType) -> st.SearchStrategy[VehicleProfile]:
    """What a vehicle of this type might say of itself, nonsense included."""
    names = ["NAV_ACC_RAD", "MIS_TKO_LAND_REQ", "RTL_TYPE", "FW_LND_ANG", "MPC_XY_CRUISE", "GF_MAX_HOR_DIST"]
    return st.builds(
        VehicleProfile,
        vehicle_type=st.just(vehicle_type),
        firmware=st.none() | st.builds(FirmwareVersion, st.just(1), st.integers(8, 19), st.just(0)),
        uid=st.none() | st.just("0001"),
        home=st.none() | st.builds(GlobalPosition, st.floats(-90, 90), st.floats(-180, 180), st.just(488.0)),
        parameters=st.dictionaries(st.sampled_from(names), st.integers(-1, 20)),
        max_mission_items=st.integers(1, 500),
    )


_SCRAP: st.SearchStrategy[Any] = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=5),
    st.lists(st.integers(), max_size=2),
    st.dictionaries(st.text(max_size=5), st.integers(), max_size=2),
)
JSON_SCRAP = st.recursive(
    _SCRAP,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=20,
)


@st.composite
def damaged_documents(draw: st.DrawFn) -> Json:
    """A plan in which a few values, at any depth, were replaced, added or taken away."""
    document = copy.deepcopy(draw(plan_documents()))
    for _ in range(draw(st.integers(1, 3))):
        holder = draw(st.sampled_from(_containers(document)))
        if isinstance(holder, list):
            holder.append(draw(_SCRAP))
        else:
            keys = sorted(key for key in holder if isinstance(key, str))
            known: st.SearchStrategy[str] = st.sampled_from(keys or ["a"])
            key = draw(known | st.text(max_size=6))
            holder[key] = draw(_SCRAP)
    return document


def _containers(value: Any) -> list[Any]:
    found = [value]
    for inner in value.values() if isinstance(value, dict) else value:
        if isinstance(inner, (dict, list)):
            found += _containers(inner)
    return found
