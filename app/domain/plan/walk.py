"""Walks along a plan and says, item by item, where the vehicle is and what carries it.

Rules, compiler and prediction all stand on this one walk, so that they cannot disagree.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from app.domain.in_flight import InFlight
from app.domain.plan.document import Plan
from app.domain.plan.fields import Altitude
from app.domain.plan.items import (
    ChangeSpeed,
    Delay,
    Gripper,
    Land,
    Loiter,
    PlanItem,
    ReturnToLaunch,
    Takeoff,
    Transition,
    Waypoint,
    Winch,
)
from app.domain.vehicle import HOME, GlobalPosition, VehicleFacts, VehicleType


class Carried(StrEnum):
    """What carries the vehicle: this decides whether it can stop."""

    GROUND = "ground"
    ROTARY_WING = "rotary_wing"
    FIXED_WING = "fixed_wing"
    WHEELS = "wheels"
    BUOYANCY = "buoyancy"


@dataclass(frozen=True, slots=True)
class Place:
    """A position; altitude above home."""

    latitude_deg: float
    longitude_deg: float
    relative_altitude_m: float


@dataclass(frozen=True, slots=True)
class Step:
    """One item of the walk. `start` and `end` are where it begins and ends.

    `anchor` is the index of the position item at which the vehicle still is (itself for a position item): only delays,
    speed changes and drops lie between. None after takeoff, transition, return, jump, or before any position.
    """

    index: int
    item: PlanItem
    before: Carried
    after: Carried
    start: Place
    end: Place
    anchor: int | None


_AT_START = {VehicleType.ROVER: Carried.WHEELS}
_IN_AIR = {
    VehicleType.MULTICOPTER: Carried.ROTARY_WING,
    VehicleType.FIXED_WING: Carried.FIXED_WING,
    VehicleType.VTOL: Carried.ROTARY_WING,
    VehicleType.ROVER: Carried.WHEELS,
    VehicleType.AIRSHIP: Carried.BUOYANCY,
}


def walk(
    plan: Plan, home: GlobalPosition, order: Iterable[int] | None = None, in_flight: InFlight | None = None
) -> tuple[Step, ...]:
    """The steps of a plan, in its own order or in another (jumps unrolled). Jumps themselves do not move anything.

    It begins on the ground at home, or where the vehicle flies.
    """
    steps: list[Step] = []
    carried = _AT_START.get(plan.vehicle_type, Carried.GROUND)
    place = Place(home.latitude_deg, home.longitude_deg, 0.0)
    if in_flight is not None:
        carried = carried_in_flight(plan.vehicle_type, in_flight)
        place = Place(in_flight.latitude_deg, in_flight.longitude_deg, in_flight.relative_altitude_m)
    anchor: int | None = None
    for index in range(len(plan.items)) if order is None else order:
        item = plan.items[index]
        after = _carried_after(plan.vehicle_type, item, carried)
        end = place_of(item, home, place)
        anchor = _anchor(item, index, anchor)
        steps.append(Step(index, item, carried, after, place, end, anchor))
        carried, place = after, end
    return tuple(steps)


def carried_in_flight(vehicle_type: VehicleType, in_flight: InFlight | None = None) -> Carried:
    """What carries a vehicle that flies, or drives, now; by itself a VTOL hovers."""
    if vehicle_type is VehicleType.VTOL and in_flight is not None and in_flight.wing_borne:
        return Carried.FIXED_WING
    return _IN_AIR[vehicle_type]


def reference_home(plan: Plan, facts: VehicleFacts | None) -> GlobalPosition:
    """The vehicle's home, else the plan's, else below the first position of the plan."""
    if facts is not None and facts.home is not None:
        return facts.home
    if plan.home is not None:
        return GlobalPosition(plan.home.latitude_deg, plan.home.longitude_deg, plan.home.absolute_altitude_m)
    if facts is not None:
        facts.assuming(HOME)
    positions = [item for item in plan.items if isinstance(item, (Takeoff, Waypoint, Loiter, Land))]
    ground_m = min((item.absolute_altitude_m for item in positions if item.absolute_altitude_m is not None), default=0)
    for item in positions:
        if item.latitude_deg is not None:
            return GlobalPosition(item.latitude_deg, item.longitude_deg or 0.0, ground_m)
    return GlobalPosition(0.0, 0.0, ground_m)


def relative_altitude_m(altitude: Altitude, home: GlobalPosition) -> float:
    """Metres above home, whichever way it is given."""
    if altitude.relative_altitude_m is not None:
        return altitude.relative_altitude_m
    return (altitude.absolute_altitude_m or 0.0) - home.altitude_m


def place_of(item: PlanItem, home: GlobalPosition, here: Place) -> Place:
    """Where an item ends that begins at `here`."""
    match item:
        case Takeoff(latitude_deg=None):
            return Place(home.latitude_deg, home.longitude_deg, relative_altitude_m(item, home))
        case Takeoff() | Waypoint() | Loiter() | Land():
            return Place(item.latitude_deg or 0.0, item.longitude_deg or 0.0, relative_altitude_m(item, home))
        case ReturnToLaunch():
            return Place(home.latitude_deg, home.longitude_deg, 0.0)
    return here


def _carried_after(vehicle_type: VehicleType, item: PlanItem, before: Carried) -> Carried:
    match item:
        case Takeoff() if vehicle_type is VehicleType.VTOL:
            return Carried.FIXED_WING  # NAV_VTOL_TAKEOFF ends with a transition of its own
        case Takeoff():
            return _IN_AIR[vehicle_type]
        case Waypoint() | Loiter() if before is Carried.GROUND:
            return _IN_AIR[vehicle_type]  # PX4 takes off again by itself
        case Transition() if vehicle_type is VehicleType.VTOL and before is not Carried.GROUND:
            return Carried.FIXED_WING if item.to == "fixed_wing" else Carried.ROTARY_WING
        case Land() | ReturnToLaunch() if before is not Carried.WHEELS:
            return Carried.GROUND
    return before


def _anchor(item: PlanItem, index: int, anchor: int | None) -> int | None:
    match item:
        case Waypoint() | Loiter() | Land():
            return index
        case Delay() | ChangeSpeed() | Gripper() | Winch():
            return anchor
    return None
