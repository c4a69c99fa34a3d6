"""The item types of a plan, one file each."""

from __future__ import annotations

from typing import Final, get_args

from app.domain.items.base import Forms, Item
from app.domain.items.change_speed import ChangeSpeed
from app.domain.items.delay import Delay
from app.domain.items.drop import Drop
from app.domain.items.gripper import Gripper
from app.domain.items.jump import Jump
from app.domain.items.land import Land
from app.domain.items.landing_pattern import Approach
from app.domain.items.loiter import Loiter
from app.domain.items.photo import Photo
from app.domain.items.return_to_launch import ReturnToLaunch
from app.domain.items.takeoff import Takeoff
from app.domain.items.transition import Transition
from app.domain.items.waypoint import Stop, Waypoint
from app.domain.items.winch import Winch

__all__ = [
    "FORMS",
    "ITEM_TYPES",
    "Approach",
    "ChangeSpeed",
    "Delay",
    "Drop",
    "DropItem",
    "Gripper",
    "Item",
    "Jump",
    "Land",
    "Loiter",
    "Photo",
    "PlanItem",
    "PositionItem",
    "ReturnToLaunch",
    "Stop",
    "Takeoff",
    "Transition",
    "Waypoint",
    "Winch",
    "type_of",
]

PlanItem = (
    Takeoff
    | Waypoint
    | Loiter
    | Delay
    | Gripper
    | Winch
    | ChangeSpeed
    | Transition
    | Land
    | ReturnToLaunch
    | Jump
    | Photo
)
"""All item types. The union in the plan model, its JSON Schema and the readers of other formats are derived from it."""
ITEM_TYPES: Final[tuple[type[PlanItem], ...]] = get_args(PlanItem)
FORMS: Final[Forms] = {command: form for kind in ITEM_TYPES for command, form in kind.forms.items()}
"""The item type of each MAV_CMD, in other formats. DO_LAND_START is missing: by itself it is not an item."""
PositionItem = Takeoff | Waypoint | Loiter | Land
DropItem = Gripper | Winch


def type_of(kind: type[Item]) -> str:
    """The value of `type` in a plan."""
    return str(get_args(kind.model_fields["type"].annotation)[0])
