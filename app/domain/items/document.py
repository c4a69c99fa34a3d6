"""The item types, for the editor of the page."""

from __future__ import annotations

import json
from typing import get_args

from app.domain.items import ITEM_TYPES, Drop, Item, Stop


def type_of(kind: type[Item]) -> str:
    """The value of `type` in a plan."""
    return str(get_args(kind.model_fields["type"].annotation)[0])


def item_types() -> str:
    """Return JSON: for each type its `type`, `title`, `stem`, initial fields (`fresh`) and properties."""
    types = [
        {
            "type": type_of(kind),
            "title": kind.title,
            "stem": kind.stem or type_of(kind),
            "fresh": dict(kind.fresh),
            "has_place": issubclass(kind, Stop),
            "ends": kind.lands,
            "is_drop": issubclass(kind, Drop),
            "at_stop": kind.needs_stop,
            "near_ground": kind.takes_off or kind.lands,
            "can_skip_to": not kind.takes_off and (kind.moves or kind.is_drop or kind.waits or kind.needs_stop),
        }
        for kind in ITEM_TYPES
    ]
    return json.dumps(types, indent=2) + "\n"
