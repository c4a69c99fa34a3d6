"""A mission item seen by the navigator: local coordinates and meanings instead of raw parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass

from app.simulator.geo import LocalFrame
from app.simulator.mission.item import LAND_COMMANDS, TAKEOFF_COMMANDS, Item
from app.simulator.params import Params
from app.simulator.state import Home
from app.simulator.wire import Cmd

EPSILON_RADIUS_M = 0.05


@dataclass(frozen=True, slots=True)
class Target:
    """A position item in the local frame."""

    command: int
    point: tuple[float, float]
    up_m: float
    hold_s: float
    acceptance_radius_m: float
    loiter_radius_m: float
    loiter_clockwise: bool
    leave_towards_next: bool
    """LOITER_TIME's param2, LOITER_TO_ALT's param1: the orbit is left only towards the next point."""

    @property
    def is_takeoff(self) -> bool:
        """NAV_TAKEOFF, NAV_VTOL_TAKEOFF."""
        return self.command in TAKEOFF_COMMANDS

    @property
    def is_landing(self) -> bool:
        """NAV_LAND, NAV_VTOL_LAND."""
        return self.command in LAND_COMMANDS

    @property
    def is_loiter(self) -> bool:
        """A fixed wing circles here."""
        return self.command in (Cmd.NAV_LOITER_TIME, Cmd.NAV_LOITER_UNLIM, Cmd.NAV_LOITER_TO_ALT)


def target_of(item: Item, frame: LocalFrame, home: Home, params: Params) -> Target:
    """Resolve a position item; an item without a usable altitude keeps home's height."""
    height = item.z if math.isfinite(item.z) else 0.0
    up_m = home.up_m + height if item.is_relative else height - frame.altitude_m
    default_m = float(params["NAV_ACC_RAD"])
    radius = item.param2 if item.command in (Cmd.NAV_WAYPOINT, Cmd.NAV_LAND) else math.nan
    hold = item.param1 if item.command in (Cmd.NAV_WAYPOINT, Cmd.NAV_LOITER_TIME) else 0.0
    loiter = item.param2 if item.command == Cmd.NAV_LOITER_TO_ALT else item.param3
    if item.command == Cmd.NAV_WAYPOINT or not math.isfinite(loiter) or abs(loiter) < 1e-3:
        loiter = float(params["NAV_LOITER_RAD"])
    return Target(
        command=item.command,
        point=frame.to_local(item.latitude_deg, item.longitude_deg),
        up_m=up_m,
        hold_s=hold if math.isfinite(hold) and hold > 0.0 else 0.0,
        acceptance_radius_m=radius if math.isfinite(radius) and radius > EPSILON_RADIUS_M else default_m,
        loiter_radius_m=abs(loiter),
        loiter_clockwise=loiter >= 0.0,
        leave_towards_next=_heading_required(item),
    )


def _heading_required(item: Item) -> bool:
    if item.command == Cmd.NAV_LOITER_TIME:
        return item.param2 > 0.0
    return item.command == Cmd.NAV_LOITER_TO_ALT and item.param1 > 0.0
