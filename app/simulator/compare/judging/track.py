"""The way between the items: the simulated vehicle against the recorded one, equally far in the mission."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from app.simulator.compare.heard import Dialogue, Heard
from app.simulator.compare.judging.alignment import align
from app.simulator.compare.judging.verdict import Verdict
from app.simulator.compare.sides import Stand, stands
from app.simulator.geo import LocalFrame

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
    return stands(side.broadcast("MISSION_ITEM_REACHED"), lambda heard: str(heard.fields["seq"]))


def _leg(name: str, side: Dialogue, start: Stand, end: Stand, frame: LocalFrame) -> Leg:
    positions = side.broadcast("GLOBAL_POSITION_INT")
    return Leg(name, tuple(_point(one, frame) for one in positions if start.t_s <= one.t_s <= end.t_s))


def _point(heard: Heard, frame: LocalFrame) -> Point:
    fields = heard.fields
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
        yield point, min(others, key=lambda other: math.dist(point, other))
