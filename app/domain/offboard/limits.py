"""What may be configured of the limits of offboard control."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.domain.airspace import shapes
from app.domain.airspace.geofence import FenceArea, Place
from app.domain.autopilot.capability import FlightKind
from app.domain.errors import SetpointRefusedError
from app.domain.geo import LocalProjection
from app.domain.offboard.messages import Vector
from app.domain.offboard.setpoints import (
    AccelerationBody,
    Attitude,
    BodyRates,
    GlobalPlace,
    NedAcceleration,
    NedPlace,
    NedVelocity,
    Setpoint,
    VelocityBody,
)

_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class OffboardLimits(BaseModel):
    """null: no such limit. Altitudes are above home; a rover has none. A fence is the one on board of the vehicle."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    max_speed_m_s: _Positive | None = 10.0
    max_climb_m_s: _Positive | None = 3.0
    max_descend_m_s: _Positive | None = 2.0
    max_tilt_deg: Annotated[float, Field(gt=0, lt=90)] | None = 35.0
    max_distance_m: _Positive | None = 1000.0
    min_altitude_m: float | None = 2.0
    max_altitude_m: float | None = 120.0
    when_exceeded: Literal["clamp", "refuse"] = "clamp"


LOOK_AHEAD_S: Final = 2.0
"""A velocity is checked at the position that it leads to in this time, about what a multicopter needs to stop from
10 m/s. Given with a position it displaces the vehicle by 1 / MPC_XY_P or 1 / MPC_Z_P: about 1 s.
"""
G_M_S2: Final = 9.80665
_ACROSS: Final = ("north_m_s", "east_m_s", "forward_m_s", "right_m_s", "north_m_s2", "east_m_s2")
_UPWARD: Final = ("down_m_s", "down_m_s2")


@dataclass(frozen=True, slots=True)
class VehiclePose:
    """The position and motion of the vehicle. `home_ned`: home from the EKF origin; `here` and `velocity`: north, east,
    up from home.

    None is unknown: a limit that needs it then rejects the setpoint.
    """

    kind: FlightKind
    home: tuple[float, float, float] | None = None
    """Latitude, longitude (degrees), altitude AMSL (m)."""
    home_ned: Vector | None = None
    here: Vector | None = None
    velocity: Vector = (0.0, 0.0, 0.0)
    heading_deg: float = 0.0
    fence: FenceArea | None = None
    fence_home: tuple[float, float] = (0.0, 0.0)
    """Home now, in the metres of the fence: north, east. Home can move, the fence does not."""

    def in_fence(self, north_m: float, east_m: float) -> Place:
        """East and north in the metres of the fence, of a place that is measured from home."""
        return east_m + self.fence_home[1], north_m + self.fence_home[0]


@dataclass(frozen=True, slots=True)
class Clamp:
    """A change that was made to a setpoint, with its reason."""

    code: str
    detail: str


@dataclass(frozen=True, slots=True)
class Limited:
    """A setpoint within the limits."""

    setpoint: Setpoint
    clamps: tuple[Clamp, ...] = ()


def limit(setpoint: Setpoint, limits: OffboardLimits, where: VehiclePose) -> Limited:
    """The setpoint within the limits.

    Raises:
        SetpointRefusedError: it leads beyond a limit and may not be clamped, or cannot be; the code is `limit.*`.
    """
    judge = _Judge(limits, where)
    within = judge.acceleration(judge.tilt(judge.speed(setpoint)))
    within = judge.place(within) if isinstance(within, NedPlace | GlobalPlace) else judge.motion(within)
    return Limited(within, tuple(judge.clamps))


class _Judge:
    """Applies one limit after the other and collects what it changed."""

    def __init__(self, limits: OffboardLimits, where: VehiclePose) -> None:
        self._limits = limits
        self._where = where
        self.clamps: list[Clamp] = []

    def speed(self, setpoint: Setpoint) -> Setpoint:
        """Horizontal speed (a wing chooses its own), climb and descent."""
        if isinstance(setpoint, NedVelocity):
            across, down = (setpoint.north_m_s, setpoint.east_m_s), setpoint.down_m_s
            names = ("north_m_s", "east_m_s")
        elif isinstance(setpoint, VelocityBody):
            across, down = (setpoint.forward_m_s, setpoint.right_m_s), setpoint.down_m_s
            names = ("forward_m_s", "right_m_s")
        else:
            return setpoint
        changes: dict[str, float] = {}
        most, speed = self._limits.max_speed_m_s, math.hypot(*across)
        if most is not None and speed > most and self._where.kind is not FlightKind.WING:
            self._exceeded("limit.speed", f"{speed:.1f} m/s is more than {most:g} m/s")
            changes |= {name: part * most / speed for name, part in zip(names, across, strict=True)}
        slowest = self._limits.max_climb_m_s if down < 0 else self._limits.max_descend_m_s
        if slowest is not None and abs(down) > slowest and self._where.kind is not FlightKind.ROVER:
            word = "climb" if down < 0 else "descend"
            self._exceeded(f"limit.{word}", f"to {word} with {abs(down):.1f} m/s is more than {slowest:g} m/s")
            changes["down_m_s"] = math.copysign(slowest, down)
        return setpoint.model_copy(update=changes)

    def tilt(self, setpoint: Setpoint) -> Setpoint:
        """The angle between the vehicle's own down and the earth's. Rates cannot be bounded so."""
        most = self._limits.max_tilt_deg
        if most is None or self._where.kind is FlightKind.ROVER:
            return setpoint
        if isinstance(setpoint, BodyRates):
            raise SetpointRefusedError(
                refusal="limit.tilt", detail="with body rates the tilt cannot be bounded", hint="send attitude"
            )
        if not isinstance(setpoint, Attitude) or tilt_deg(setpoint.roll_deg, setpoint.pitch_deg) <= most:
            return setpoint
        roll, pitch = setpoint.roll_deg, setpoint.pitch_deg
        self._exceeded("limit.tilt", f"{tilt_deg(roll, pitch):.0f} degrees of tilt are more than {most:g}")
        while tilt_deg(roll, pitch) > most:
            share = min(0.99, most / tilt_deg(roll, pitch))
            roll, pitch = roll * share, pitch * share
        return setpoint.model_copy(update={"roll_deg": roll, "pitch_deg": pitch})

    def acceleration(self, setpoint: Setpoint) -> Setpoint:
        """Over ground what the tilt limit gives in level flight; up and down what reaches the limit of the climb or
        the descent in `LOOK_AHEAD_S`.
        """
        if isinstance(setpoint, NedAcceleration):
            across, down = (setpoint.north_m_s2, setpoint.east_m_s2), setpoint.down_m_s2
            names = ("north_m_s2", "east_m_s2")
        elif isinstance(setpoint, AccelerationBody):
            across, down = (setpoint.forward_m_s2, setpoint.right_m_s2), setpoint.down_m_s2
            names = ("forward_m_s2", "right_m_s2")
        else:
            return setpoint
        changes: dict[str, float] = {}
        tilt, size = self._limits.max_tilt_deg, math.hypot(*across)
        most = math.inf if tilt is None else G_M_S2 * math.tan(math.radians(tilt))
        if size > most:
            self._exceeded("limit.tilt", f"{size:.1f} m/s² over ground needs more than {tilt:g} degrees of tilt")
            changes |= {name: part * most / size for name, part in zip(names, across, strict=True)}
        fastest = self._limits.max_climb_m_s if down < 0 else self._limits.max_descend_m_s
        if fastest is not None and abs(down) > fastest / LOOK_AHEAD_S:
            word = "climb" if down < 0 else "descend"
            self._exceeded(f"limit.{word}", f"{abs(down):.1f} m/s² is more than {fastest / LOOK_AHEAD_S:g} m/s²")
            changes["down_m_s2"] = math.copysign(fastest / LOOK_AHEAD_S, down)
        return setpoint.model_copy(update=changes)

    def place(self, setpoint: NedPlace | GlobalPlace) -> Setpoint:
        """Distance from home, altitude, and the fence along the straight way; then what is given beside the place."""
        point = self._point_of(setpoint)
        if point is None:
            if self._bounds_places():
                raise SetpointRefusedError(
                    refusal="limit.home_unknown", detail="home is not known, so no distance can be checked"
                )
            return setpoint  # type: ignore[return-value]
        if self._where.kind is FlightKind.WING:
            return self._path_point(setpoint, point)
        within = self._within(point)
        self._refuse_beyond_fence(within)
        moved = setpoint if within == point else self._moved(setpoint, within)
        return self._feed_forward(moved, within) if isinstance(moved, NedVelocity) else moved  # type: ignore[return-value]

    def motion(self, setpoint: Setpoint) -> Setpoint:
        """Where a velocity leads; for what has none, where the vehicle is drifting to."""
        here = self._here()
        if here is None:
            return setpoint
        velocity = self._velocity_of(setpoint)
        if velocity is None:
            self._refuse_drift(here, setpoint)
            return setpoint
        lead = _lead(velocity)
        across, upward = self._leads_on(here, lead), self._climbs_on(here[2], lead[2])
        return _stopped(setpoint, across=not across, upward=not upward)

    # parts ----------------------------------------------------------------------------------------------------

    def _exceeded(self, code: str, detail: str) -> None:
        if self._limits.when_exceeded == "refuse":
            raise SetpointRefusedError(refusal=code, detail=detail, hint="send less, or configure the limits to clamp")
        self.clamps.append(Clamp(code, detail))

    def _here(self) -> Vector | None:
        """Where the vehicle is. Raises SetpointRefusedError: unknown, but a limit needs it."""
        if self._where.here is None and self._bounds_places():
            raise SetpointRefusedError(
                refusal="limit.position_unknown", detail="the vehicle's place from home is not known"
            )
        return self._where.here

    def _bounds_places(self) -> bool:
        limits = self._limits
        heights = () if self._where.kind is FlightKind.ROVER else (limits.min_altitude_m, limits.max_altitude_m)
        return self._where.fence is not None or any(one is not None for one in (limits.max_distance_m, *heights))

    def _point_of(self, setpoint: NedPlace | GlobalPlace) -> Vector | None:
        """North, east, up from home."""
        where = self._where
        if isinstance(setpoint, NedPlace):
            if where.home_ned is None:
                return None
            north, east, down = where.home_ned
            up = 0.0 if setpoint.down_m is None else down - setpoint.down_m
            return setpoint.north_m - north, setpoint.east_m - east, up
        if where.home is None:
            return None
        latitude, longitude, altitude = where.home
        east, north = LocalProjection(latitude, longitude).to_local(setpoint.latitude_deg, setpoint.longitude_deg)
        above = setpoint.altitude_m if setpoint.altitude_type == "rel_home" else setpoint.altitude_m - altitude
        return north, east, above

    def _path_point(self, setpoint: NedPlace | GlobalPlace, point: Vector) -> Setpoint:
        """To a wing it is a point of its path: moved it would be another path, and the wing flies on beyond it."""
        self._strict()._within(point)
        self._refuse_beyond_fence(point)
        if self._where.here is not None:
            self._refuse_drift(self._where.here, setpoint)
        return setpoint  # type: ignore[return-value]

    def _feed_forward(self, setpoint: NedVelocity, point: Vector) -> Setpoint:
        """PX4 adds velocity and acceleration to its way to the place, and stays beside the place as long as they last.

        So they may lead beyond no limit, from the vehicle and from the place, nor from anywhere on the way between.
        """
        here = self._here()
        if here is None:
            return setpoint  # type: ignore[return-value]
        leads = (_lead((setpoint.north_m_s, setpoint.east_m_s, -setpoint.down_m_s)), *self._accelerated(setpoint))
        ways = [(start, lead) for start in (here, point) for lead in leads]
        across = all(self._keeps_distance(start, lead) for start, lead in ways) and self._stays_inside(
            [here, point], [(start[0] + lead[0], start[1] + lead[1]) for start, lead in ways]
        )
        upward = all(self._climbs_on(start[2], lead[2]) for start, lead in ways)
        return _stopped(setpoint, across=not across, upward=not upward)  # type: ignore[arg-type]

    def _stays_inside(self, starts: list[Vector], ends: list[tuple[float, float]]) -> bool:
        """Whether the fence encloses all that lies between; the starts alone are not judged here."""
        places = [self._where.in_fence(*one[:2]) for one in (*starts, *ends)]
        fence = self._where.fence
        if fence is None or set(places[len(starts) :]) <= set(places[: len(starts)]):
            return True
        if fence.allows(shapes.MultiPoint(places).convex_hull):
            return True
        self._exceeded("limit.fence", "beside its place it leads out of the fence on board")
        return False

    def _strict(self) -> _Judge:
        return _Judge(self._limits.model_copy(update={"when_exceeded": "refuse"}), self._where)

    def _within(self, point: Vector) -> Vector:
        north, east, up = point
        away, most = math.hypot(north, east), self._limits.max_distance_m
        if most is not None and away > most:
            self._exceeded("limit.distance", f"{away:.0f} m from home is more than {most:g} m")
            north, east = north * most / away, east * most / away
        low, high = self._limits.min_altitude_m, self._limits.max_altitude_m
        if self._where.kind is not FlightKind.ROVER:
            if high is not None and up > high:
                self._exceeded("limit.altitude", f"{up:.0f} m above home is more than {high:g} m")
                up = high
            if low is not None and up < low:
                self._exceeded("limit.altitude", f"{up:.1f} m above home is less than {low:g} m")
                up = low
        return north, east, up

    def _moved(self, setpoint: NedPlace | GlobalPlace, point: Vector) -> NedPlace | GlobalPlace:
        north, east, up = point
        if isinstance(setpoint, NedPlace):
            home_n, home_e, home_d = self._where.home_ned or (0.0, 0.0, 0.0)
            down = None if setpoint.down_m is None else home_d - up
            return setpoint.model_copy(update={"north_m": north + home_n, "east_m": east + home_e, "down_m": down})
        latitude, longitude, altitude = self._where.home or (0.0, 0.0, 0.0)
        place = LocalProjection(latitude, longitude).to_global(east, north)
        height = up if setpoint.altitude_type == "rel_home" else altitude + up
        return setpoint.model_copy(update={"latitude_deg": place[0], "longitude_deg": place[1], "altitude_m": height})

    def _refuse_beyond_fence(self, point: Vector) -> None:
        """A position cannot be moved inside a fence without changing the course. From outside the way must lead in."""
        fence, here = self._where.fence, self._where.here
        if fence is None:
            return
        end = self._where.in_fence(*point[:2])
        start = end if here is None else self._where.in_fence(*here[:2])
        if fence.allows(shapes.Point(end) if start == end else shapes.LineString((start, end))):
            return
        if not fence.allows(shapes.Point(end)) or not fence.leads_back(start, end):
            raise SetpointRefusedError(refusal="limit.fence", detail="the straight way there leaves the fence on board")

    def _velocity_of(self, setpoint: Setpoint) -> Vector | None:
        """North, east, up."""
        if isinstance(setpoint, NedVelocity):
            return setpoint.north_m_s, setpoint.east_m_s, -setpoint.down_m_s
        if isinstance(setpoint, VelocityBody):
            return *self._turned(setpoint.forward_m_s, setpoint.right_m_s), -setpoint.down_m_s
        return None

    def _turned(self, forward: float, right: float) -> tuple[float, float]:
        """North and east, by the heading."""
        cos, sin = (f(math.radians(self._where.heading_deg)) for f in (math.cos, math.sin))
        return forward * cos - right * sin, forward * sin + right * cos

    def _leads_on(self, here: Vector, lead: Vector) -> bool:
        """Whether the vehicle stays within the distance and the fence; moving back inside is always allowed."""
        there = (here[0] + lead[0], here[1] + lead[1])
        if not self._keeps_distance(here, lead):
            return False
        fence = self._where.fence
        if fence is None or there == here[:2]:
            return True
        start, end = self._where.in_fence(*here[:2]), self._where.in_fence(*there)
        if not fence.allows(shapes.LineString((start, end))) and not fence.leads_back(start, end):
            self._exceeded("limit.fence", "it leads out of the fence on board")
            return False
        return True

    def _keeps_distance(self, here: Vector, lead: Vector) -> bool:
        most, away = self._limits.max_distance_m, math.hypot(here[0] + lead[0], here[1] + lead[1])
        if most is not None and away > most and away > math.hypot(here[0], here[1]):
            self._exceeded("limit.distance", f"it leads more than {most:g} m from home")
            return False
        return True

    def _climbs_on(self, height: float, by_m: float) -> bool:
        low, high = self._limits.min_altitude_m, self._limits.max_altitude_m
        there = height + by_m
        if self._where.kind is FlightKind.ROVER:
            return True
        if by_m > 0 and high is not None and there > high:
            self._exceeded("limit.altitude", f"it leads more than {high:g} m above home")
            return False
        if by_m < 0 and low is not None and there < low:
            self._exceeded("limit.altitude", f"it leads less than {low:g} m above home")
            return False
        return True

    def _refuse_drift(self, here: Vector, setpoint: BaseModel) -> None:
        """Attitude and acceleration cannot be clamped to a place: they end where the vehicle would leave its limits."""
        velocity = self._where.velocity
        speed, up = math.hypot(velocity[0], velocity[1]), velocity[2]
        most = self._limits.max_speed_m_s
        if most is not None and speed > most and self._where.kind is not FlightKind.WING:
            raise SetpointRefusedError(refusal="limit.speed", detail=f"the vehicle already moves with {speed:.1f} m/s")
        fastest = self._limits.max_climb_m_s if up > 0 else self._limits.max_descend_m_s
        if isinstance(setpoint, NedAcceleration | AccelerationBody) and fastest is not None and abs(up) > fastest:
            refusal, does = ("limit.climb", "climbs") if up > 0 else ("limit.descend", "descends")
            raise SetpointRefusedError(refusal=refusal, detail=f"the vehicle already {does} with {abs(up):.1f} m/s")
        drift = _lead(velocity)
        for more in ((0.0, 0.0, 0.0), *self._accelerated(setpoint)):
            lead = (drift[0] + more[0], drift[1] + more[1], drift[2] + more[2])
            self._strict()._leads_on(here, lead)
            self._strict()._climbs_on(here[2], lead[2])

    def _accelerated(self, setpoint: BaseModel) -> tuple[Vector, ...]:
        """Where an acceleration leads; empty without one.

        In the vehicle's own axes it turns with the tilt, which is not known: all of it may lead up, or down.
        """
        if isinstance(setpoint, NedAcceleration):
            return (_lead_from_rest((setpoint.north_m_s2, setpoint.east_m_s2, -setpoint.down_m_s2)),)
        if isinstance(setpoint, AccelerationBody):
            north, east = self._turned(setpoint.forward_m_s2, setpoint.right_m_s2)
            size = math.hypot(north, east, setpoint.down_m_s2)
            return _lead_from_rest((north, east, size)), _lead_from_rest((north, east, -size))
        return ()


def _lead(velocity: Vector) -> Vector:
    """How far it leads in `LOOK_AHEAD_S`."""
    north, east, up = velocity
    return north * LOOK_AHEAD_S, east * LOOK_AHEAD_S, up * LOOK_AHEAD_S


def _lead_from_rest(acceleration: Vector) -> Vector:
    """How far it leads in `LOOK_AHEAD_S`, from rest."""
    north, east, up = _lead(acceleration)
    return north * LOOK_AHEAD_S / 2, east * LOOK_AHEAD_S / 2, up * LOOK_AHEAD_S / 2


def _stopped(setpoint: Setpoint, *, across: bool, upward: bool) -> Setpoint:
    """With zero in the place of its motion over ground, and of its climb or descent."""
    names = (*(_ACROSS if across else ()), *(_UPWARD if upward else ()))
    return setpoint.model_copy(update={name: 0.0 for name in names if name in type(setpoint).model_fields})


def tilt_deg(roll_deg: float, pitch_deg: float) -> float:
    """The angle between the vehicle's own vertical axis and the earth's."""
    upright = math.cos(math.radians(roll_deg)) * math.cos(math.radians(pitch_deg))
    return math.degrees(math.acos(max(-1.0, min(1.0, upright))))
