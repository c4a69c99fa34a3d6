"""Where the straight leg of a return may end: what a fence must leave free."""

from __future__ import annotations

from collections.abc import Sequence

from app.domain.autopilot import behaviour
from app.domain.prediction.effort import Flight
from app.domain.prediction.motion import Motion, Point
from app.domain.prediction.path_return import Passage, lands_ahead
from app.domain.prediction.return_to_launch import destinations, follows_mission


def return_ends(flight: Flight, here: Point, positions: Sequence[Passage], index: int) -> Sequence[Point]:
    """From `here`, at the item with this index; none for a way back along the mission, whose legs are its own."""
    landing = next((place.point for place in positions if place.lands), None)
    if not follows_mission(flight.facts):
        return destinations(flight, Motion(here), landing)
    ahead = lands_ahead(behaviour(flight.facts).returns, positions, index)
    return (landing,) if ahead and landing is not None else ()
