"""The landing at a flight's end: at its destination, or broken off by a failsafe or a pilot."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from app.domain.geo import distance_m
from app.domain.mission import LANDINGS, Mission, MissionItem
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunAction
from app.domain.vehicle.state import FlightMode, GlobalPosition, VehicleState, VehicleType

_BY_MISSION: Final = frozenset({None, FlightMode.MISSION, FlightMode.TAKEOFF, FlightMode.HOLD})
"""Modes in which standing on the ground is part of the mission, or says nothing of how it came there."""
RETURNS: Final = frozenset({RunAction.RETURN, RunAction.CONTINGENCY})
_SAYS_NOTHING: Final = frozenset({None, FlightMode.HOLD})
"""PX4 goes back to Hold as it disarms."""
_NEAR_M: Final = 15.0
_NEAR_RUNWAY_M: Final = 200.0
_LANDED_BY_HAND: Final = frozenset({VehicleType.FIXED_WING, VehicleType.AIRSHIP})
"""These need a strip or a crew."""
_TURNS_WITHIN_M: Final = 100.0
"""A fixed wing turns away before a place that it flies through."""
_UNSEEN: Final = Reason.of(ReasonCode.LANDING_UNSEEN)
_FRESH_S: Final = 3.0
"""An older position may be from before it was lost."""
_TOLD_WITHIN_S: Final = 2.0
"""EXTENDED_SYS_STATE may come a second late, and one may be lost."""
_FALLS_M: Final = 4.0
_SINKS_M: Final = 10.0
"""PX4 descends 3 m in that time at most. A wing that is landed by hand may lose a few metres more, and its motors be
stopped as it touches the ground.
"""


class HeightTracker(NamedTuple):
    """The altitudes (AMSL) that a vehicle in the air reported last, with the time of each on its clock, in seconds.

    PX4 says landed as soon as it is disarmed, and moves home to there: the altitude above home tells no fall.
    """

    heard: tuple[tuple[float, float], ...] = ()

    def in_air(self, state: VehicleState) -> HeightTracker:
        """After an observation of a vehicle in the air."""
        if state.absolute_altitude_m is None or state.boot_time_s is None:
            return self
        return HeightTracker((*self._until(state.boot_time_s), (state.boot_time_s, state.absolute_altitude_m)))

    def highest_m(self, state: VehicleState) -> float | None:
        """The altitude from which it came down, as it says that it is on the ground; None if none is known."""
        lately = () if state.boot_time_s is None else self._until(state.boot_time_s)
        return max((altitude_m for _, altitude_m in lately), default=None)

    def _until(self, boot_time_s: float) -> tuple[tuple[float, float], ...]:
        return tuple(one for one in self.heard if 0.0 < boot_time_s - one[0] <= _TOLD_WITHIN_S)


class Touchdown(NamedTuple):
    """The vehicle as it came to stand on the ground. `mode` and `home`: those of its descent, as far as it was seen;
    PX4 moves home to the place as it disarms there. `reason`: why it came down, as the run said until then. Not
    `is_seen`: the link was lost before, and what the vehicle flew then is not known. `from_m` is the altitude (AMSL)
    from which it came down, None if not known.
    """

    state: VehicleState
    mode: FlightMode | None
    home: GlobalPosition | None
    reason: Reason | None
    is_seen: bool = True
    took_off_from: GlobalPosition | None = None
    from_m: float | None = None

    @classmethod
    def of(
        cls,
        state: VehicleState,
        before: VehicleState | None,
        reason: Reason | None,
        *,
        is_seen: bool = True,
        took_off_from: GlobalPosition | None = None,
        from_m: float | None = None,
    ) -> Touchdown:
        """`before` is the last observation before it, None after a restart; `took_off_from` is home as it was then. The
        reason of a landing that was not seen is known if it was coming down before, or still is in a mode that is not
        the mission's. `from_m`: see HeightTracker.highest_m.
        """
        mode, home = state.mode, took_off_from or state.home
        if before is None:
            is_known = mode not in (*_BY_MISSION, FlightMode.RETURN)
        else:
            mode = before.mode if mode in _SAYS_NOTHING else mode
            home = before.home or home
            is_known = before.in_failsafe and before.mode is mode
        return cls(state, mode, home, reason if is_seen or is_known else _UNSEEN, is_seen, took_off_from, from_m)

    def lost_sight_of(self, state: VehicleState) -> Touchdown:
        """After a loss of the link on the ground: it may have flown on, and landed again. One that a failsafe had
        brought down has not.
        """
        keeps_reason = self.state.in_failsafe or not self.is_seen
        return self._replace(state=state, is_seen=False, reason=self.reason if keeps_reason else _UNSEEN)

    def located(self, state: VehicleState) -> Touchdown:
        """With the first position of the vehicle since it stands there. After a loss of the link it may come late."""
        return self if self._has_position else self._replace(state=state)

    @property
    def is_by_mission(self) -> bool:
        """Whether a mission may have brought the vehicle down, by the mode."""
        return self.mode in _BY_MISSION

    def why_fallen(self, state: VehicleState, vehicle_type: VehicleType) -> Reason | None:
        """Why it is no landing, of a vehicle that has come to rest: it was far above that place a moment before it said
        landed, or was terminated in the air. None if it was not, or if its altitude is not known.
        """
        if self.reason is not None and self.reason.code is ReasonCode.TERMINATED:
            return self.reason
        is_known = self.from_m is not None and state.absolute_altitude_m is not None and _is_fresh(state)
        fallen_m = (self.from_m or 0.0) - (state.absolute_altitude_m or 0.0) if is_known else 0.0
        least_m = _SINKS_M if vehicle_type in _LANDED_BY_HAND else _FALLS_M
        return Reason.of(ReasonCode.FELL, fallen_m=round(fallen_m, 1)) if fallen_m > least_m else None

    def why_elsewhere(self, mission: Mission, commanded: RunAction | None, vehicle_type: VehicleType) -> Reason | None:
        """Why it is not the destination of the return or landing that was flown; None if it is, whoever flew it there.

        A return is judged by its place, if that is known: whoever disarms a vehicle in Return mode ends it anywhere.
        PX4 flies a landing item in Mission mode; one that was not seen is judged by its place, too.
        """
        mode, last = self.mode, mission.items[-1]
        returns = commanded in RETURNS or mission.is_return(last.seq)
        if not returns and not mission.ends_with_landing:
            return None  # it ends in the air, and is landed by somebody
        near_m = _NEAR_RUNWAY_M if vehicle_type in _LANDED_BY_HAND else _NEAR_M
        places = self._returns_to(mission, vehicle_type) if returns else [_place(last)]
        is_by_mission = self.is_by_mission or (returns and mode is FlightMode.RETURN)
        is_place_known = self._has_position and (self.home is not None or not returns)
        if is_by_mission and (not is_place_known or (self.is_seen and not returns)):
            return None
        is_known = mode is not FlightMode.DESCEND  # PX4 descends where it has no position
        if is_known and any(self._is_at(*place, near_m) for place in places):
            return None
        return Reason.of(ReasonCode.LANDED_ELSEWHERE, self.reason or Reason.of(ReasonCode.VEHICLE_LANDS))

    def _returns_to(self, mission: Mission, vehicle_type: VehicleType) -> Iterator[tuple[float, float]]:
        """Latitude and longitude of home, of the rally points, and of landings: RTL_TYPE says which PX4 may take.

        As a rover's return begins at a waypoint, PX4 moves home to there, and a repeated return would go there.
        """
        has_moved = vehicle_type is VehicleType.ROVER and self.took_off_from is not None
        homes = (None if has_moved else self.home, self.took_off_from)
        yield from ((home.latitude_deg, home.longitude_deg) for home in homes if home is not None)
        yield from map(_place, mission.rally)
        yield from (_place(item) for item in mission.items if item.command in LANDINGS)

    @property
    def _has_position(self) -> bool:
        return _is_fresh(self.state) and self.state.latitude_deg is not None

    def _is_at(self, latitude_deg: float, longitude_deg: float, near_m: float) -> bool:
        if not self._has_position or self.state.latitude_deg is None or self.state.longitude_deg is None:
            return False
        away_m = distance_m(self.state.latitude_deg, self.state.longitude_deg, latitude_deg, longitude_deg)
        return away_m <= near_m


def _is_fresh(state: VehicleState) -> bool:
    return state.position_age_s is not None and state.position_age_s <= _FRESH_S


def is_near(state: VehicleState, item: MissionItem) -> bool:
    """Whether the vehicle has come to a place of its mission, or turns there."""
    if state.latitude_deg is None or state.longitude_deg is None:
        return False
    return distance_m(state.latitude_deg, state.longitude_deg, *_place(item)) <= _TURNS_WITHIN_M


def _place(item: MissionItem) -> tuple[float, float]:
    return item.x / 1e7, item.y / 1e7
