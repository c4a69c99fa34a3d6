"""A mission item as a file has it, before anybody asks what it means."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

PLAN_COLUMNS: Final = tuple(f"/params/{index}" for index in range(7))
TEXT_COLUMNS: Final = ("/param1", "/param2", "/param3", "/param4", "/latitude", "/longitude", "/altitude")


@dataclass(frozen=True, slots=True)
class ItemExtra:
    """The `waydrop` object of an item: what the file format has no place for.

    `fields` are fields of the plan item. `written` is what stands in the format's own places instead of some of them:
    once somebody has changed it there, that change counts and `fields` is old. `role` is set on items that are no
    plan item of their own: `speed` and `pause` go with the next one, `cruise_speed` and `wait` with the one before.
    """

    pointer: str
    id: str = ""
    role: str = ""
    fields: Mapping[str, Any] | None = None
    written: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class FileItem:
    """One MISSION_ITEM: MAV_CMD, MAV_FRAME, param1 to param7. None is "not given", NaN on the wire.

    `number` is what a DO_JUMP calls it by. `columns` are the places of the parameters below `pointer`.
    """

    command: int
    frame: int
    params: tuple[float | None, ...]
    number: int
    pointer: str
    columns: tuple[str, ...] = PLAN_COLUMNS
    extra: ItemExtra | None = None

    def param(self, number: int) -> float | None:
        """param1 to param7."""
        return self.params[number - 1]

    def at(self, number: int) -> str:
        """The pointer of a parameter."""
        return self.pointer + self.columns[number - 1]
