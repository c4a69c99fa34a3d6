"""The course of a flight: its progress in the mission, its track, and the home position."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from app.simulator.geo import LocalFrame
from tools.compare.alignment import Alignment, Verdict, align, late, pair_up
from tools.compare.trace import Dialogue, ReceivedMessage, Stand, stands

# The course of a flight: mission items, mission_state, landed_state, vtol_state, mode and arming, and their times.


ARMED = 128
AUTOPILOT_PX4 = 12
CURRENT_PERIOD_S = 1.02
"""As recorded: 1.01 to 1.02 s from one MISSION_CURRENT to the next."""


@dataclass(frozen=True, slots=True)
class _Aspect:
    name: str
    message: str
    period_s: float
    value: Callable[[ReceivedMessage], str | None]


def _field(field: str) -> Callable[[ReceivedMessage], str | None]:
    return lambda received: str(received.fields[field])


def _plan(received: ReceivedMessage) -> str:
    fields = received.fields
    ids = f"{fields['mission_id']}, fence {fields['fence_id']}, rally {fields['rally_points_id']}"
    return f"{fields['total']} items, id {ids}"


def _mode(received: ReceivedMessage) -> str | None:
    fields = received.fields
    if fields["autopilot"] != AUTOPILOT_PX4:
        return None  # of another ground station, forwarded
    mode = fields["custom_mode"]
    return f"mode {mode >> 16 & 0xFF}.{mode >> 24}{' armed' if fields['base_mode'] & ARMED else ''}"


ASPECTS = (
    _Aspect("mission items reached", "MISSION_ITEM_REACHED", 1.0, _field("seq")),
    _Aspect("current mission item", "MISSION_CURRENT", CURRENT_PERIOD_S, _field("seq")),
    _Aspect("mission_state", "MISSION_CURRENT", CURRENT_PERIOD_S, _field("mission_state")),
    _Aspect("stored mission", "MISSION_CURRENT", CURRENT_PERIOD_S, _plan),
    _Aspect("mission_mode", "MISSION_CURRENT", CURRENT_PERIOD_S, _field("mission_mode")),
    _Aspect("landed_state", "EXTENDED_SYS_STATE", 0.2, _field("landed_state")),
    _Aspect("vtol_state", "EXTENDED_SYS_STATE", 0.2, _field("vtol_state")),
    _Aspect("mode and arming", "HEARTBEAT", 1.0, _mode),
)


def judge_progress(recorded: Dialogue, simulated: Dialogue) -> Iterator[Verdict]:
    """One verdict for each aspect on the order of values, one on their times."""
    acts = (recorded.acts_s(), simulated.acts_s())
    for aspect in ASPECTS:
        ours = stands(recorded.broadcast(aspect.message), aspect.value)
        theirs = stands(simulated.broadcast(aspect.message), aspect.value)
        if not ours and not theirs:
            continue
        alignment = align(ours, theirs)
        yield Verdict(aspect.name, len(ours), alignment.differences)
        yield Verdict(f"{aspect.name}: times", len(alignment.pairs), tuple(late(alignment, aspect.period_s, acts)))


# The way between the items: the simulated vehicle against the recorded one, equally far in the mission.


ASPECT = "track"
DISTANCE_M, HEIGHT_M, SHARE = 5.0, 2.0, 0.05
LONG_S = 3.0
"""A leg that is shorter has no track to speak of."""

Point = tuple[float, float, float]
"""North, east, up."""
Pair = tuple[Stand, Stand]
"""Recorded and simulated."""


@dataclass(frozen=True, slots=True)
class Leg:
    """The way from one item reached to the next; `points` in order, about four a second."""

    name: str
    points: tuple[Point, ...]

    @property
    def length_m(self) -> float:
        """Along the way."""
        return sum(math.dist(a, b) for a, b in itertools.pairwise(self.points))


def judge_track(recorded: Dialogue, simulated: Dialogue, frame: LocalFrame) -> Iterator[Verdict]:
    """Each recorded point of a leg has a simulated one of the same leg near it, and the other way round.

    Near: within 5 m, or 5 % of the leg, and in height within 2 m. The points are some metres from each other.
    """
    pairs = align(_reached(recorded), _reached(simulated)).pairs
    both = []
    for n, ((a, b), (a_end, b_end)) in enumerate(itertools.pairwise(pairs)):
        if a_end.t_s - a.t_s >= LONG_S:
            again = sum((one.value, end.value) == (a.value, a_end.value) for (one, _), (end, _) in _before(pairs, n))
            name = f"{a.value} to {a_end.value}, flight {again + 1}"
            both.append((_leg(name, recorded, a, a_end, frame), _leg(name, simulated, b, b_end, frame)))
    if both:
        found = tuple(text for a, b in both for text in _apart(a, b))
        yield Verdict(ASPECT, sum(len(leg.points) for leg, _ in both), found)


def _before(pairs: Sequence[Pair], index: int) -> Iterator[tuple[Pair, Pair]]:
    """The legs before this one that were long enough."""
    found = itertools.islice(itertools.pairwise(pairs), index)
    return (leg for leg in found if leg[1][0].t_s - leg[0][0].t_s >= LONG_S)


def _reached(side: Dialogue) -> list[Stand]:
    return stands(side.broadcast("MISSION_ITEM_REACHED"), lambda received: str(received.fields["seq"]))


def _leg(name: str, side: Dialogue, start: Stand, end: Stand, frame: LocalFrame) -> Leg:
    positions = side.broadcast("GLOBAL_POSITION_INT")
    return Leg(name, tuple(_point(one, frame) for one in positions if start.t_s <= one.t_s <= end.t_s))


def _point(received: ReceivedMessage, frame: LocalFrame) -> Point:
    fields = received.fields
    north_m, east_m = frame.to_local(fields["lat"] / 1e7, fields["lon"] / 1e7)
    return north_m, east_m, fields["relative_alt"] / 1000.0


def _apart(ours: Leg, theirs: Leg) -> Iterator[str]:
    """Where the two are farthest from each other."""
    if not ours.points or not theirs.points:
        return
    pairs = [*_nearest(ours.points, theirs.points), *_nearest(theirs.points, ours.points)]
    apart_m = max(math.dist(a[:2], b[:2]) for a, b in pairs)
    if apart_m > max(DISTANCE_M, SHARE * ours.length_m):
        yield f"{ours.name}: {apart_m:.1f} m apart on a leg of {ours.length_m:.0f} m"
    height_m = max(abs(a[2] - b[2]) for a, b in pairs)
    if height_m > HEIGHT_M:
        yield f"{ours.name}: {height_m:.1f} m apart in height"


def _nearest(points: Sequence[Point], others: Sequence[Point]) -> Iterator[tuple[Point, Point]]:
    for point in points:
        yield point, min(others, key=partial(math.dist, point))


# HOME_POSITION: that it comes, where it is, and where and when it moves to.


HOME_ASPECT = "home position"
PERIOD_S = 2.0
MOVED_M = 3.0
"""Less is the estimate's noise: PX4 sets home anew at every arming."""
HOME_DISTANCE_M, HOME_HEIGHT_M, HOME_SHARE = 2.0, 0.5, 0.15


@dataclass(frozen=True, slots=True)
class Place:
    """A home that was shown from `t_s` on. `moved_m` is the way from the one before, 0 for the first."""

    t_s: float
    north_m: float
    east_m: float
    amsl_m: float
    moved_m: float


def judge_home(recorded: Dialogue, simulated: Dialogue, frame: LocalFrame) -> Iterator[Verdict]:
    """The places within 2 m, or 15 % of the way there; heights within 0.5 m; the moves at the same times."""
    ours, theirs = list(places(recorded, frame)), list(places(simulated, frame))
    if not ours and not theirs:
        return
    pairs = pair_up(ours, theirs, _distance_m)
    missing = tuple(f"missing: home at {one.t_s:.1f} s" for one in ours if not any(one is a for a, _ in pairs))
    extra = tuple(f"extra: home at {one.t_s:.1f} s" for one in theirs if not any(one is b for _, b in pairs))
    apart = tuple(text for a, b in pairs for text in _home_apart(a, b))
    yield Verdict(HOME_ASPECT, len(ours), missing + extra + apart)
    alignment = Alignment(tuple((_stand(a), _stand(b)) for a, b in pairs), ())
    acts = (recorded.acts_s(), simulated.acts_s())
    yield Verdict(f"{HOME_ASPECT}: times", len(alignment.pairs), tuple(late(alignment, PERIOD_S, acts)))


def places(side: Dialogue, frame: LocalFrame) -> Iterator[Place]:
    """The first home, and each that is more than 3 m away from the one before."""
    last: Place | None = None
    for received in side.broadcast("HOME_POSITION"):
        fields = received.fields
        north_m, east_m = frame.to_local(fields["latitude"] / 1e7, fields["longitude"] / 1e7)
        moved_m = math.dist((north_m, east_m), (last.north_m, last.east_m)) if last else 0.0
        if last is None or moved_m > MOVED_M:
            last = Place(received.t_s, north_m, east_m, fields["altitude"] / 1000.0, moved_m)
            yield last


def _stand(home: Place) -> Stand:
    return Stand(home.t_s, "home", 1)


def _distance_m(a: Place, b: Place) -> float:
    return math.dist((a.north_m, a.east_m), (b.north_m, b.east_m))


def _home_apart(a: Place, b: Place) -> Iterator[str]:
    apart_m = _distance_m(a, b)
    if apart_m > max(HOME_DISTANCE_M, HOME_SHARE * a.moved_m):
        yield f"{apart_m:.1f} m apart, after a move of {a.moved_m:.1f}, simulated {b.moved_m:.1f} m"
    if abs(a.amsl_m - b.amsl_m) > HOME_HEIGHT_M:
        yield f"at {a.amsl_m:.2f} m, simulated {b.amsl_m:.2f} m"
