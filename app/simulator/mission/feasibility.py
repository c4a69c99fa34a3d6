"""PX4's check of a whole mission, run after the upload was acknowledged; an infeasible mission is kept but never flown.

Independent of Waydrop's own rules on purpose: whatever Waydrop accepts has to pass here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from app.simulator.airframe import Airframe
from app.simulator.firmware import FirmwareProfile
from app.simulator.geo import LocalFrame
from app.simulator.mission.geofence import Geofence
from app.simulator.mission.item import LAND_COMMANDS, TAKEOFF_COMMANDS, Item
from app.simulator.params import Params
from app.simulator.state import Home
from app.simulator.wire import Cmd

VTOL_COMMANDS = frozenset({Cmd.NAV_VTOL_TAKEOFF, Cmd.NAV_VTOL_LAND, Cmd.DO_VTOL_TRANSITION})


@dataclass(frozen=True, slots=True)
class Problem:
    """Why a mission is not feasible. `text` is empty where PX4 says it only by an EVENT; `event` is its name."""

    event: str
    text: str = ""
    arguments: tuple[float, ...] = ()
    """Of the event."""


@dataclass(frozen=True, slots=True)
class FeasibilityInput:
    """What the check looks at."""

    items: tuple[Item, ...]
    airframe: Airframe
    params: Params
    frame: LocalFrame
    home: Home | None
    fence: Geofence
    landed: bool
    profile: FirmwareProfile


def problems(mission: FeasibilityInput) -> Iterator[Problem]:
    """All that is wrong, in the order of PX4's checks; nothing for a feasible mission."""
    if not mission.items:
        return
    if mission.home is None:
        yield Problem("navigator_mis_no_home_rel_alt")
        return
    yield from _commands(mission)
    yield from _first_waypoint(mission)
    yield from _takeoff(mission)
    yield from _land_start(mission)
    yield from _required_items(mission)
    if mission.airframe.is_fixed_wing:
        yield from _fixed_wing_landing(mission)
    yield from _fence(mission, mission.home)


def height_above_home_m(item: Item, home: Home, frame: LocalFrame) -> float:
    return item.z if item.is_relative else item.z - (frame.altitude_m + home.up_m)


def first_waypoint_m(mission: FeasibilityInput) -> float:
    """From home to the first item with a position; 0 without one."""
    first = next((item for item in mission.items if item.has_position), None)
    if first is None or mission.home is None:
        return 0.0
    return math.dist(_point(mission, first), (mission.home.north_m, mission.home.east_m))


def _commands(mission: FeasibilityInput) -> Iterator[Problem]:
    for seq, item in enumerate(mission.items):
        if item.command in VTOL_COMMANDS and not mission.airframe.is_vtol:
            yield Problem("navigator_mis_unsup_cmd", arguments=(seq + 1, item.command))
    first = mission.items[0]
    if mission.landed and first.command in LAND_COMMANDS:
        yield Problem("navigator_mis_starts_w_landing")


def _first_waypoint(mission: FeasibilityInput) -> Iterator[Problem]:
    """Up to v1.15; later versions only warn."""
    distance_m, most_m = first_waypoint_m(mission), float(mission.params["MIS_DIST_1WP"])
    if mission.profile.judges_start and distance_m >= most_m > 0.0:
        text = f"First waypoint too far away: {distance_m:.0f}m, {most_m:.0f} max"
        yield Problem("navigator_mis_first_wp_too_far", text, (distance_m, most_m))


def _takeoff(mission: FeasibilityInput) -> Iterator[Problem]:
    """A takeoff item has to come before every other position item and to lie above home, up to v1.15 so high that it is
    not reached before the vehicle is 1 m in the air.
    """
    assert mission.home is not None
    position_seen = False
    least_m = float(mission.params["NAV_ACC_RAD"]) + 1.0 if mission.profile.judges_start else 0.0
    for item in mission.items:
        if item.command in TAKEOFF_COMMANDS:
            height_m = height_above_home_m(item, mission.home, mission.frame)
            if height_m < least_m:
                yield Problem(
                    "navigator_mis_takeoff_too_low", "Mission rejected: Takeoff altitude too low!", (least_m,)
                )
            elif height_m <= 0.0:
                yield Problem("navigator_mis_takeoff_too_low")
            if position_seen:
                yield Problem("navigator_mis_takeoff_not_first")
        position_seen = position_seen or item.has_position


def _land_start(mission: FeasibilityInput) -> Iterator[Problem]:
    if not (mission.airframe.is_fixed_wing or mission.airframe.is_vtol):
        return
    if mission.items[0].command in LAND_COMMANDS:  # in the air too
        yield Problem("navigator_mis_starts_w_landing2")
    starts = [seq for seq, item in enumerate(mission.items) if item.command == Cmd.DO_LAND_START]
    if len(starts) > 1:
        yield Problem("navigator_mis_multiple_land")
    for start in starts:
        after = mission.items[start + 1 :]
        if any(item.command == Cmd.NAV_RETURN_TO_LAUNCH for item in after):
            yield Problem("navigator_mis_land_before_rtl")
        if not any(item.command in LAND_COMMANDS for item in after):
            yield Problem("navigator_mis_invalid_land")


def _required_items(mission: FeasibilityInput) -> Iterator[Problem]:
    """MIS_TKO_LAND_REQ. An RTL item is no landing."""
    requirement = mission.params.integer("MIS_TKO_LAND_REQ")
    takeoff = any(item.command in TAKEOFF_COMMANDS for item in mission.items)
    land = any(item.command in LAND_COMMANDS for item in mission.items)
    if requirement == 3 and not (takeoff and land):
        yield Problem("navigator_mis_takeoff_or_land_missing")
    if requirement == 1 and not takeoff:
        yield Problem("navigator_mis_takeoff_missing")
    if requirement == 2 and not land:
        yield Problem("navigator_mis_land_missing")
    if (requirement == 4 or (requirement == 5 and mission.landed)) and takeoff != land:
        yield Problem("navigator_mis_add_land_or_rm_to" if takeoff else "navigator_mis_add_to_or_rm_land")


def _fixed_wing_landing(mission: FeasibilityInput) -> Iterator[Problem]:
    """The approach to LAND: from a waypoint or a loiter down to altitude, higher, outside its orbit, not too steep."""
    assert mission.home is not None
    for seq, item in enumerate(mission.items):
        if item.command != Cmd.NAV_LAND or seq == 0:
            continue
        before = mission.items[seq - 1]
        if before.command not in (Cmd.NAV_WAYPOINT, Cmd.NAV_LOITER_TO_ALT):
            yield Problem("navigator_mis_unsupported_landing_approach_wp")
            continue
        yield from _glide_slope(mission, mission.home, before, item)


def _glide_slope(mission: FeasibilityInput, home: Home, before: Item, land: Item) -> Iterator[Problem]:
    distance_m = math.dist(_point(mission, before), _point(mission, land))
    drop_m = height_above_home_m(before, home, mission.frame) - height_above_home_m(land, home, mission.frame)
    if before.command == Cmd.NAV_LOITER_TO_ALT:
        radius_m = abs(before.param2) if abs(before.param2) > 1e-3 else float(mission.params["NAV_LOITER_RAD"])
        if distance_m <= radius_m:
            yield Problem("navigator_mis_land_wp_inside_orbit_radius")
            return
        distance_m = math.sqrt(distance_m**2 - radius_m**2)
    if drop_m <= 0.0:
        yield Problem("navigator_mis_approach_wp_below_land")
        return
    angle_deg = float(mission.params["FW_LND_ANG"])
    steepest = math.tan(math.radians(angle_deg + 0.1))
    if distance_m <= 0.0 or drop_m / distance_m > steepest:
        yield Problem("navigator_mis_glide_slope_too_steep", arguments=(int(angle_deg), int(angle_deg % 1.0 * 10.0)))


def _fence(mission: FeasibilityInput, home: Home) -> Iterator[Problem]:
    """Waypoints only, not legs. PX4 names the first offender, counted from 1."""
    fence = mission.fence.valid_at((home.north_m, home.east_m))
    if fence.empty and not mission.fence.empty:
        return  # the fence is invalid against home and then not used
    horizontal_m = float(mission.params["GF_MAX_HOR_DIST"])
    vertical_m = float(mission.params["GF_MAX_VER_DIST"])
    for seq, item in enumerate(mission.items):
        if not item.has_position:
            continue
        point = _point(mission, item)
        too_far = 0.0 < horizontal_m < math.dist(point, (home.north_m, home.east_m))
        too_high = 0.0 < vertical_m < height_above_home_m(item, home, mission.frame)
        if too_far or too_high or not fence.allows(point):
            text = f"Geofence violation for waypoint {seq + 1}"
            yield Problem("navigator_mis_geofence_violation", text, (seq + 1,))
            return


def _point(mission: FeasibilityInput, item: Item) -> tuple[float, float]:
    return mission.frame.to_local(item.latitude_deg, item.longitude_deg)
