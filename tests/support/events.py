"""Events for tests, and what one tells as it is stored and sent."""

from __future__ import annotations

from typing import Any

from app.domain.events import Event, NewEvent
from app.domain.events.run import RunItem


def data_of(event: NewEvent | Event) -> dict[str, Any]:
    """The data of an event as a JSON object."""
    data: dict[str, Any] = event.data.model_dump(mode="json")
    return data


def item(number: int = 0, item_id: str | None = None) -> RunItem:
    """A small payload that a test can tell from others by its number."""
    return RunItem(seq=number, phase="current", item_id=item_id)
