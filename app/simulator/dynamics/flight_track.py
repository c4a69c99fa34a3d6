"""What a multicopter's flight task makes of the navigator's three points (FlightTaskAuto's internal waypoints)."""

from __future__ import annotations

import math
from enum import Enum, auto

from app.simulator.dynamics.position_smoothing import Leg, Point
from app.simulator.setpoint import Setpoint, SetpointKind

SAME_M = 0.001
STOPS = (SetpointKind.LOITER, SetpointKind.LAND)
"""Nothing comes after these, also when a mission goes on from its landing."""

_Ends = tuple[Point, bool, bool]


class _Place(Enum):
    ON_TRACK = auto()
    TARGET_BEHIND = auto()
    START_AHEAD = auto()
    OFF_TRACK = auto()


class FlightTrack:
    """The line to fly; beside it by more than the acceptance radius the vehicle goes back to it first."""

    def __init__(self) -> None:
        self._known: _Ends | None = None
        self._place = _Place.ON_TRACK
        self._given = self._leg = Leg((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)

    def reset(self) -> None:
        """Forget: the next setpoint is a new one."""
        self._known = None

    def leg(self, body: Point, setpoint: Setpoint) -> Leg:
        """Of this cycle."""
        renewed = self._take(setpoint)
        before, (self._place, closest) = self._place, self._where(body)
        if renewed or self._place is not before or self._place is _Place.OFF_TRACK:
            self._leg = self._detour(body, closest)
        return self._leg

    def _take(self, setpoint: Setpoint) -> bool:
        """Read the setpoint when it is another: without a start it is flown to from anywhere, and there is no line."""
        target = (setpoint.north_m, setpoint.east_m, setpoint.up_m)
        ends = (target, setpoint.previous is None, setpoint.next is None)
        known = self._known
        if known is not None and known[1:] == ends[1:] and math.dist(known[0], target) < SAME_M:
            return False
        self._known = ends
        start = target if setpoint.previous is None else (*setpoint.previous, setpoint.previous_up_m)
        after = target
        if setpoint.next is not None and setpoint.kind not in STOPS:
            after = (*setpoint.next, setpoint.next_up_m)
        self._given = Leg(start, target, after, setpoint.acceptance_radius_m)
        return True

    def _where(self, body: Point) -> tuple[_Place, Point]:
        """Seen from above, with the point of the line that is closest to the vehicle."""
        given, radius_m = self._given, self._given.acceptance_radius_m
        along = (given.target[0] - given.start[0], given.target[1] - given.start[1])
        length_m = math.hypot(*along)
        if length_m < SAME_M:
            return _Place.ON_TRACK, given.target
        unit = (along[0] / length_m, along[1] / length_m)
        gone = (body[0] - given.start[0], body[1] - given.start[1])
        gone_m = gone[0] * unit[0] + gone[1] * unit[1]
        closest = (given.start[0] + unit[0] * gone_m, given.start[1] + unit[1] * gone_m, given.target[2])
        if gone_m > length_m:
            return _Place.TARGET_BEHIND, closest
        if gone_m < 0.0 and math.hypot(*gone) > radius_m:
            return _Place.START_AHEAD, closest
        beside_m = math.dist(body[:2], closest[:2])
        return (_Place.OFF_TRACK if beside_m > radius_m else _Place.ON_TRACK), closest

    def _detour(self, body: Point, closest: Point) -> Leg:
        given, radius_m = self._given, self._given.acceptance_radius_m
        if self._place is _Place.TARGET_BEHIND:
            return Leg(body, given.target, given.after, radius_m)
        if self._place is _Place.START_AHEAD:
            return Leg(body, given.start, given.target, radius_m)
        if self._place is _Place.OFF_TRACK:
            return Leg(body, closest, given.target, radius_m)
        return given
