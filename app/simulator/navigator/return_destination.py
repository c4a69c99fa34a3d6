"""Where a return goes: home, a rally point or the mission's landing, by RTL_TYPE.

Types 2 and 4 follow the mission's path on the real vehicle; here every way is direct, to the same destination.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from app.simulator.mission.item import LAND_COMMANDS
from app.simulator.mission.store import MissionStore
from app.simulator.navigator.context import NavContext

Point = tuple[float, float]


class ReturnDestination:
    """The first LAND item is the mission's landing, also one on the way to somewhere else."""

    def __init__(self, context: NavContext, store: MissionStore) -> None:
        self._context = context
        self._store = store

    def choose(self) -> Point:
        """North and east of the place; home when nothing else is there."""
        home, landing, rally = self._home, self._landing, self._rally
        match self._context.params.integer("RTL_TYPE"):
            case 1:
                return self._closest([*landing, *rally]) or home
            case 2:
                return landing[0] if landing else home
            case 3:
                return self._closest([home, *landing, *rally]) or home
            case 4:
                return landing[0] if landing and self._landing_is_fewer_items_away() else home
            case 5:
                return self._closest(rally) or home
        return self._closest([home, *rally]) or home

    @property
    def _home(self) -> Point:
        return self._context.home.north_m, self._context.home.east_m

    @property
    def _rally(self) -> list[Point]:
        frame = self._context.frame
        return [frame.to_local(item.latitude_deg, item.longitude_deg) for item in self._store.rally.items]

    @property
    def _landing_seq(self) -> int | None:
        items = self._store.mission.items
        return next((seq for seq, item in enumerate(items) if item.command in LAND_COMMANDS), None)

    @property
    def _landing(self) -> list[Point]:
        if self._landing_seq is None:
            return []
        item = self._store.mission.items[self._landing_seq]
        return [self._context.frame.to_local(item.latitude_deg, item.longitude_deg)]

    def _landing_is_fewer_items_away(self) -> bool:
        done = self._store.current_seq
        return self._landing_seq is not None and abs(self._landing_seq - done) <= done

    def _closest(self, places: Iterable[Point]) -> Point | None:
        body = self._context.state.body
        here = (body.north_m, body.east_m)
        return min(places, key=lambda place: math.dist(place, here), default=None)
