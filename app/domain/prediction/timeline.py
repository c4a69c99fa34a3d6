"""The timeline: what a plan is predicted to do. Times are seconds from the start of the flight."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from typing import Literal

from app.domain.model import FrozenForm
from app.domain.prediction.motion import CALM, Wind


class TimelineEntry(FrozenForm):
    """One visit of one plan item. `seqs` are its mission items (none for a supervised drop at a waypoint).

    Position and altitude (above home) are those at the end. `brakes`: the vehicle comes to a stop there.
    `uncertainty_s`: the additional error of the time, in both directions, because PX4 does something that cannot be
    predicted. `battery_used_percent` is the use of the item in percent of a full battery, null if no rate is declared
    for the vehicle, and `energy_wh` the same in watt hours, null without a declared capacity.
    """

    item_id: str
    type: str
    visit: int
    seqs: tuple[int, ...]
    start_s: float
    end_s: float
    duration_s: float
    distance_m: float
    ground_speed_m_s: float
    latitude_deg: float
    longitude_deg: float
    relative_altitude_m: float
    brakes: bool
    uncertainty_s: float = 0.0
    battery_used_percent: float | None = None
    energy_wh: float | None = None


class PredictedDrop(FrozenForm):
    """Where and how one drop is predicted to act.

    `lead_m` is the distance before the point, along the track, at which the release happens; `offset_m` the distance
    from the point (the radius, on a circle). The release position is null on a circle: it can be anywhere on it.
    `fall_s` and `throw_m` describe the fall to the height of home, with drag and wind: its duration, and the distance
    over ground from the release to the landing position, which is null on a circle. `return_battery_percent`: the use
    of a return from there, null if no rate is declared.
    """

    item_id: str
    visit: int
    supervised: bool
    release_motion: Literal["stopped", "moving"]
    at_s: float
    ground_speed_m_s: float
    relative_altitude_m: float
    lead_m: float
    offset_m: float
    release_latitude_deg: float | None
    release_longitude_deg: float | None
    fall_s: float
    throw_m: float
    landing_latitude_deg: float | None = None
    landing_longitude_deg: float | None = None
    return_battery_percent: float | None = None


class PredictedAlternate(FrozenForm):
    """The other place of one drop: no part of the flight that is predicted, only of one in which that drop fails.

    `seqs` are its mission items. Distance and time are of the way there, the time with its drop. The altitude is above
    home.
    """

    item_id: str
    drop_id: str
    seqs: tuple[int, ...]
    latitude_deg: float
    longitude_deg: float
    relative_altitude_m: float
    distance_m: float
    duration_s: float


class Timeline(FrozenForm):
    """`order` is the ids of the items as flown, jumps unrolled; jumps themselves are not in it, they take no time.

    `open_ended`: the last item does not end. `truncated`: more visits than are predicted. `longest_duration_s`, if
    there are `alternates`: of a flight in which each such drop fails at the end of its hold. `wind` is the wind of the
    prediction. `battery_start_percent` is the charge at the check, null if unknown (then a full battery is assumed),
    `battery_used_percent` the use of the whole flight, null if no rate is declared.
    """

    entries: tuple[TimelineEntry, ...]
    drops: tuple[PredictedDrop, ...]
    order: tuple[str, ...]
    distance_m: float
    duration_s: float
    open_ended: bool = False
    truncated: bool = False
    alternates: tuple[PredictedAlternate, ...] = ()
    longest_duration_s: float | None = None
    wind: Wind = CALM
    battery_start_percent: float | None = None
    battery_used_percent: float | None = None

    def continued(self, flown: Collection[tuple[str, int]], rest: Timeline) -> Timeline:
        """The timeline of a flight whose plan was changed: what was flown of this one, then the rest.

        `flown` are the visits (item id, number) that have ended; the visits of the rest count on from them.
        """
        kept = [entry for entry in self.entries if (entry.item_id, entry.visit) in flown]
        visits = Counter(item_id for item_id, _ in flown)
        after_s = sum(entry.duration_s for entry in kept)
        entries = [
            entry.model_copy(
                update={
                    "visit": entry.visit + visits[entry.item_id],
                    "start_s": entry.start_s + after_s,
                    "end_s": entry.end_s + after_s,
                }
            )
            for entry in rest.entries
        ]
        ahead = {drop.item_id for drop in rest.drops}
        drops = [drop for drop in self.drops if drop.item_id not in ahead]
        longest_s = rest.longest_duration_s
        moved = [drop.model_copy(update={"at_s": drop.at_s + after_s}) for drop in rest.drops]
        return rest.model_copy(
            update={
                "entries": (*kept, *entries),
                "drops": (*drops, *moved),
                "order": tuple(entry.item_id for entry in (*kept, *entries)),
                "distance_m": sum(entry.distance_m for entry in kept) + rest.distance_m,
                "duration_s": after_s + rest.duration_s,
                "longest_duration_s": None if longest_s is None else after_s + longest_s,
            }
        )

    def first(self, visits: int) -> Timeline:
        """Its first visits; itself if it has no more."""
        if len(self.entries) <= visits:
            return self
        kept = {(entry.item_id, entry.visit) for entry in self.entries[:visits]}
        return self.model_copy(
            update={
                "entries": self.entries[:visits],
                "drops": tuple(drop for drop in self.drops if (drop.item_id, drop.visit) in kept),
                "order": self.order[:visits],
                "truncated": True,
            }
        )
