"""The landing at a flight's end: at its destination, or broken off by a failsafe or a pilot."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from app.domain.geo import distance_m
from app.domain.mission import MavCmd, Mission, MissionItem
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunAction
from app.domain.vehicle.state import FlightMode, VehicleState, VehicleType

_BY_MISSION: Final = frozenset({None, FlightMode.MISSION, FlightMode.TAKEOFF, FlightMode.HOLD})
"""Modes in which standing on the ground is part of the mission, or says nothing of how it came there."""
_RETURNS: Final = frozenset({RunAction.RETURN, RunAction.CONTINGENCY})
_LANDINGS: Final = frozenset({MavCmd.NAV_LAND, MavCmd.NAV_VTOL_LAND})
_NEAR_M: Final = 15.0
_NEAR_RUNWAY_M: Final = 200.0
"""Of a fixed wing that is landed by hand: it needs a strip."""


class Touchdown(NamedTuple):
    """The vehicle as it came to stand on the ground, and the reason of the run's state until then.

    PX4 moves home to the place as it disarms there.
    """

    state: VehicleState
    reason: Reason | None

    @property
    def is_by_mission(self) -> bool:
        """Whether a mission may have brought the vehicle down, by the mode."""
        return self.state.mode in _BY_MISSION

    def why_elsewhere(self, mission: Mission, commanded: RunAction | None, vehicle_type: VehicleType) -> Reason | None:
        """Why it is not the destination of the return or landing that was flown; None if it is, whoever flew it there.

        PX4 flies a return in Return mode until it disarms, and a landing item in Mission mode.
        """
        mode, last = self.state.mode, mission.items[-1]
        returns = commanded in _RETURNS or mission.is_return(last.seq)
        if self.is_by_mission or (returns and mode is FlightMode.RETURN):
            return None
        if not returns and last.command not in _LANDINGS:
            return None  # it ends in the air, and is landed by somebody
        near_m = _NEAR_RUNWAY_M if vehicle_type is VehicleType.FIXED_WING else _NEAR_M
        places = self._returns_to(mission) if returns else [_place(last)]
        is_known = mode is not FlightMode.DESCEND  # PX4 descends where it has no position
        if is_known and any(self._is_at(*place, near_m) for place in places):
            return None
        return Reason.of(ReasonCode.LANDED_ELSEWHERE, self.reason or Reason.of(ReasonCode.VEHICLE_LANDS))

    def _returns_to(self, mission: Mission) -> Iterator[tuple[float, float]]:
        """Latitude and longitude of home, and of the rally points, of which PX4 takes the nearest."""
        if self.state.home is not None:
            yield self.state.home.latitude_deg, self.state.home.longitude_deg
        yield from map(_place, mission.rally)

    def _is_at(self, latitude_deg: float, longitude_deg: float, near_m: float) -> bool:
        if self.state.latitude_deg is None or self.state.longitude_deg is None:
            return False
        away_m = distance_m(self.state.latitude_deg, self.state.longitude_deg, latitude_deg, longitude_deg)
        return away_m <= near_m


def _place(item: MissionItem) -> tuple[float, float]:
    return item.x / 1e7, item.y / 1e7
