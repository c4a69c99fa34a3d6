"""The landing at a mission's end: whether the vehicle flew it, or a failsafe or a pilot broke it off."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from app.domain.geo import distance_m
from app.domain.mission import MavCmd, Mission, MissionItem
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.state import FlightMode, VehicleState, VehicleType

_BY_MISSION: Final = frozenset({None, FlightMode.MISSION, FlightMode.TAKEOFF, FlightMode.HOLD})
"""Modes in which standing on the ground is part of the mission, or says nothing of how it came there."""
_LANDINGS: Final = frozenset({MavCmd.NAV_LAND, MavCmd.NAV_VTOL_LAND})
_NEAR_M: Final = 15.0
_NEAR_RUNWAY_M: Final = 200.0
"""Of a fixed wing that is landed by hand: it needs a strip."""


def is_by_mission(landed_in: FlightMode | None) -> bool:
    """Whether a mission may have brought the vehicle down, by the mode in which it came to stand."""
    return landed_in in _BY_MISSION


def why_broken_off(
    mission: Mission, landed_in: FlightMode | None, state: VehicleState, vehicle_type: VehicleType
) -> Reason | None:
    """Why the mission's last landing does not count; None if it was flown, or the vehicle stands at its place anyway.

    PX4 flies a return item in Return mode until it disarms, and a landing item in Mission mode.
    """
    if not mission.items or is_by_mission(landed_in):
        return None
    last = mission.items[-1]
    returns = mission.is_return(last.seq)
    if not returns and last.command not in _LANDINGS:
        return None  # it ends in the air, and is landed by somebody
    if returns and landed_in is FlightMode.RETURN:
        return None
    near_m = _NEAR_RUNWAY_M if vehicle_type is VehicleType.FIXED_WING else _NEAR_M
    places = _returns_to(mission, state) if returns else [_place(last)]
    is_known = landed_in is not FlightMode.DESCEND  # PX4 descends where it has no position
    if is_known and any(away is not None and away <= near_m for away in (_away_m(state, *place) for place in places)):
        return None
    assert landed_in is not None, "a landing in no known mode is not judged"
    return Reason.of(ReasonCode.LANDING_BROKEN_OFF, mode=landed_in.value)


def _returns_to(mission: Mission, state: VehicleState) -> Iterator[tuple[float, float]]:
    """Latitude and longitude of home, and of the rally points, of which PX4 takes the nearest."""
    if state.home is not None:
        yield state.home.latitude_deg, state.home.longitude_deg
    yield from map(_place, mission.rally)


def _place(item: MissionItem) -> tuple[float, float]:
    return item.x / 1e7, item.y / 1e7


def _away_m(state: VehicleState, latitude_deg: float, longitude_deg: float) -> float | None:
    if state.latitude_deg is None or state.longitude_deg is None:
        return None
    return distance_m(state.latitude_deg, state.longitude_deg, latitude_deg, longitude_deg)
