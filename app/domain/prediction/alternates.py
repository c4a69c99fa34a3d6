"""What the timeline says of the other places: beside the flight that is meant, from one that goes over all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from app.domain.plan.detour import Detour
from app.domain.prediction.timeline import PredictedAlternate, Timeline


def with_alternates(meant: Timeline, detour: Detour, over: Timeline, seqs_of: Mapping[str, Sequence[int]]) -> Timeline:
    """The timeline of the plan as it is meant, with its alternates named. `over` is that of the detour's plan."""
    found = []
    for item_id, drop_id in detour.drops.items():
        visits = [entry for entry in over.entries if entry.item_id == item_id]
        if visits:
            found.append(
                PredictedAlternate(
                    item_id=item_id,
                    drop_id=drop_id,
                    seqs=tuple(seqs_of.get(item_id, ())),
                    latitude_deg=visits[0].latitude_deg,
                    longitude_deg=visits[0].longitude_deg,
                    relative_altitude_m=visits[0].relative_altitude_m,
                    distance_m=sum(entry.distance_m for entry in visits),
                    duration_s=sum(entry.duration_s for entry in visits),
                )
            )
    return meant.model_copy(update={"alternates": tuple(found), "longest_duration_s": over.duration_s})
