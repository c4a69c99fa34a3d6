"""What a journal's events tell of plans and runs, to hold their tables against it."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterable, Iterator
from typing import Any, Final

from app.domain.events import EventKind

_WHOLE_RUN: Final = (EventKind.RUN_CREATED, EventKind.RUN_CHANGED)
_NOT_TOLD: Final = "updated_at"
"""A drop's event does not carry it."""


class Told:
    """Filled event by event, in order. Every change of a run is told by an event, stored in the same transaction."""

    def __init__(self) -> None:
        self._plans: dict[str, object] = {}
        self._runs: dict[str, dict[str, Any]] = {}

    def take(self, kind: str, run_id: str | None, data: str) -> None:
        """One event. `data` is its JSON text."""
        if kind == EventKind.PLAN_CREATED:
            told = _object(data)
            self._plans[str(told.get("plan_id"))] = told.get("hash")
        elif run_id is not None and kind in _WHOLE_RUN:
            self._runs[run_id] = _object(data)
        elif run_id in self._runs and kind == EventKind.RUN_DROP:
            drop, run = _object(data), self._runs[run_id]
            item = drop.get("plan_item_id")
            run["drops"] = [drop if old.get("plan_item_id") == item else old for old in run.get("drops", [])]

    def altered_plans(self, rows: Iterable[sqlite3.Row]) -> Iterator[str]:
        """Plans that are not the ones that were posted. A plan whose event was never stored is held to its own hash."""
        missing = dict(self._plans)
        for row in rows:
            told = missing.pop(row["id"], row["hash"])
            if not _hash(row["document"]) == row["hash"] == told:
                yield f"plan {row['id']} is not the one that was posted"
        for plan_id in missing:
            yield f"plan {plan_id} was posted, and is missing"

    def altered_runs(self, rows: Iterable[sqlite3.Row]) -> Iterator[str]:
        """Runs that are not as their events left them. A field that only one side knows came with another version."""
        missing = dict(self._runs)
        for row in rows:
            told, stored = missing.pop(row["id"], None), _object(row["document"])
            if told is None:
                yield f"run {row['id']} is told of by no event"
                continue
            names = (told.keys() & stored.keys()) - {_NOT_TOLD}
            differing = sorted(name for name in names if told[name] != stored[name])
            if differing or not names:
                yield f"run {row['id']} is not as its events left it: {', '.join(differing) or 'nothing is left'}"
        for run_id in missing:
            yield f"run {run_id} is told of by events, and is missing"


def _hash(document: str) -> str:
    """As domain/plan/identity.py does it, over what is stored."""
    text = json.dumps(_object(document), sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def _object(text: str) -> dict[str, Any]:
    try:
        value = json.loads(text)
    except ValueError:
        return {}
    return value if isinstance(value, dict) else {}
