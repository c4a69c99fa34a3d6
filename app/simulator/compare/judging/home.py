"""HOME_POSITION: that it comes, where it is, and where and when it moves to."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from app.simulator.compare.heard import Dialogue
from app.simulator.compare.judging.alignment import Alignment, late
from app.simulator.compare.judging.pairing import pair_up
from app.simulator.compare.judging.verdict import Verdict
from app.simulator.compare.sides import Stand
from app.simulator.geo import LocalFrame

ASPECT = "home position"
PERIOD_S = 2.0
MOVED_M = 3.0
"""Less is the estimate's noise: PX4 sets home anew at every arming."""
DISTANCE_M, HEIGHT_M, SHARE = 2.0, 0.5, 0.15


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
    apart = tuple(text for a, b in pairs for text in _apart(a, b))
    yield Verdict(ASPECT, len(ours), missing + extra + apart)
    alignment = Alignment(tuple((_stand(a), _stand(b)) for a, b in pairs), ())
    acts = (recorded.acts_s(), simulated.acts_s())
    yield Verdict(f"{ASPECT}: times", len(alignment.pairs), tuple(late(alignment, PERIOD_S, acts)))


def places(side: Dialogue, frame: LocalFrame) -> Iterator[Place]:
    """The first home, and each that is more than 3 m away from the one before."""
    last: Place | None = None
    for heard in side.broadcast("HOME_POSITION"):
        fields = heard.fields
        north_m, east_m = frame.to_local(fields["latitude"] / 1e7, fields["longitude"] / 1e7)
        moved_m = math.dist((north_m, east_m), (last.north_m, last.east_m)) if last else 0.0
        if last is None or moved_m > MOVED_M:
            last = Place(heard.t_s, north_m, east_m, fields["altitude"] / 1000.0, moved_m)
            yield last


def _stand(home: Place) -> Stand:
    return Stand(home.t_s, "home", 1)


def _distance_m(a: Place, b: Place) -> float:
    return math.dist((a.north_m, a.east_m), (b.north_m, b.east_m))


def _apart(a: Place, b: Place) -> Iterator[str]:
    apart_m = _distance_m(a, b)
    if apart_m > max(DISTANCE_M, SHARE * a.moved_m):
        yield f"{apart_m:.1f} m apart, after a move of {a.moved_m:.1f}, simulated {b.moved_m:.1f} m"
    if abs(a.amsl_m - b.amsl_m) > HEIGHT_M:
        yield f"at {a.amsl_m:.2f} m, simulated {b.amsl_m:.2f} m"
