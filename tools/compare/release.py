"""Where and how fast the vehicle was when its gripper opened."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from app.simulator.geo import LocalFrame
from app.simulator.wire import Cmd
from tools.compare.alignment import Verdict, pair_up
from tools.compare.trace import Dialogue, ReceivedMessage

GRAB, RELEASE = 2000, 1000
PLACES = frozenset(
    {
        Cmd.NAV_WAYPOINT,
        Cmd.NAV_LOITER_UNLIM,
        Cmd.NAV_LOITER_TIME,
        Cmd.NAV_LOITER_TO_ALT,
        Cmd.NAV_LAND,
        Cmd.NAV_VTOL_LAND,
    }
)
"""Items that a drop may be at; a takeoff is none."""
DISTANCE_M, SPEED_M_S, SHARE = 2.0, 0.5, 0.15


@dataclass(frozen=True, slots=True)
class Release:
    """The output went from grab to release. `distance_m` is to the mission's drop point."""

    t_s: float
    north_m: float
    east_m: float
    speed_m_s: float
    distance_m: float
    """0 without a drop point."""


def judge_releases(recorded: Dialogue, simulated: Dialogue, frame: LocalFrame, servo: str | None) -> Iterator[Verdict]:
    """The places within 2 m, or 15 % of the distance to the drop point; ground speeds within 0.5 m/s or 15 %."""
    ours, theirs = (list(releases(side, frame, servo)) for side in (recorded, simulated))
    if not ours and not theirs:
        return
    pairs = pair_releases(ours, theirs)
    found = [f"missing: release at {one.t_s:.1f} s" for one in ours if not any(one is a for a, _ in pairs)]
    found += [f"extra: release at {one.t_s:.1f} s" for one in theirs if not any(one is b for _, b in pairs)]
    for a, b in pairs:
        apart_m = math.dist((a.north_m, a.east_m), (b.north_m, b.east_m))
        if apart_m > max(DISTANCE_M, SHARE * a.distance_m):
            found.append(
                f"{apart_m:.1f} m apart; from the drop point {a.distance_m:.1f}, simulated {b.distance_m:.1f} m"
            )
        if abs(a.speed_m_s - b.speed_m_s) > max(SPEED_M_S, SHARE * a.speed_m_s):
            found.append(f"at {a.speed_m_s:.1f} m/s, simulated {b.speed_m_s:.1f} m/s")
    yield Verdict("release", len(ours), tuple(found))


def pair_releases(ours: Sequence[Release], theirs: Sequence[Release]) -> list[tuple[Release, Release]]:
    """In order; when one side has more, those are left over that are nearest to none in place and time."""
    return pair_up(ours, theirs, _unlikeness)


def _unlikeness(a: Release, b: Release) -> float:
    apart_m = math.dist((a.north_m, a.east_m), (b.north_m, b.east_m))
    return (0.0 if math.isnan(apart_m) else apart_m) + abs(a.t_s - b.t_s)


def releases(side: Dialogue, frame: LocalFrame, servo: str | None) -> Iterator[Release]:
    """Every opening of the gripper, in order."""
    if servo is None:
        return
    drop = _drop_point(side, frame)
    positions = side.broadcast("GLOBAL_POSITION_INT")
    before = None
    for received in side.broadcast("SERVO_OUTPUT_RAW"):
        output = received.fields[servo]
        if before == GRAB and output == RELEASE:
            north_m, east_m, speed_m_s = _at(positions, received.t_s, frame)
            distance_m = math.dist(drop, (north_m, east_m)) if drop else 0.0
            yield Release(received.t_s, north_m, east_m, speed_m_s, distance_m)
        before = output


def _drop_point(side: Dialogue, frame: LocalFrame) -> tuple[float, float] | None:
    """The last position item before the mission's gripper item; the first one when there is no gripper item."""
    waypoint: tuple[float, float] | None = None
    first: tuple[float, float] | None = None
    for sent in side.sent:
        if sent.name not in ("MISSION_ITEM_INT", "MISSION_ITEM"):
            continue
        if sent.fields["command"] == Cmd.DO_GRIPPER:
            return waypoint
        if sent.fields["x"] and sent.fields["command"] in PLACES:
            unit = 1e7 if sent.name == "MISSION_ITEM_INT" else 1.0
            waypoint = frame.to_local(sent.fields["x"] / unit, sent.fields["y"] / unit)
            first = first or waypoint
    return first


def _at(positions: list[ReceivedMessage], t_s: float, frame: LocalFrame) -> tuple[float, float, float]:
    """North, east and ground speed at a time, carried on from the newest position before it; NaN without any."""
    if not positions:
        return math.nan, math.nan, math.nan
    newest = max((one for one in positions if one.t_s <= t_s), key=lambda one: one.t_s, default=positions[0])
    fields = newest.fields
    north_m, east_m = frame.to_local(fields["lat"] / 1e7, fields["lon"] / 1e7)
    v_north_m_s, v_east_m_s = fields["vx"] / 100.0, fields["vy"] / 100.0
    age_s = max(0.0, t_s - newest.t_s)
    return north_m + v_north_m_s * age_s, east_m + v_east_m_s * age_s, math.hypot(v_north_m_s, v_east_m_s)
