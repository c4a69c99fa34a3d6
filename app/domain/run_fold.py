"""A run as its events tell it: what the journal's chain bears, whatever the table of runs says."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from pydantic import ValidationError

from app.domain.events import EventKind
from app.domain.run import Run

_WHOLE: Final = frozenset({EventKind.RUN_CREATED, EventKind.RUN_CHANGED, EventKind.RUN_CONTINUED})


class RunFold:
    """Takes one run's events in order."""

    def __init__(self) -> None:
        self._document: dict[str, Any] | None = None
        self._drops: dict[str, Any] = {}

    @property
    def is_told(self) -> bool:
        """Whether any event told of the run."""
        return self._document is not None

    @property
    def knows_when(self) -> bool:
        """Whether the newest event told `updated_at` too: a drop's does not."""
        return not self._drops

    def take(self, kind: str, data: Mapping[str, Any]) -> None:
        """One event."""
        if kind in _WHOLE:
            self._document, self._drops = dict(data), {}
        elif kind == EventKind.RUN_DROP:
            self._drops[str(data.get("plan_item_id"))] = data
        elif kind == EventKind.RUN_UPLOAD_PROGRESS and self._document is not None:
            self._document["upload_percent"] = data.get("percent")

    def run(self) -> Run | None:
        """The run after the newest event; None if nothing told of it, or not as this version can read it."""
        if self._document is None:
            return None
        drops = self._document.get("drops")
        try:
            if not isinstance(drops, list | tuple):
                return None
            told = [self._drops.get(str(drop["plan_item_id"]), drop) for drop in drops]
            return Run.model_validate({**self._document, "drops": told})
        except (ValidationError, TypeError, KeyError):
            return None
