"""What a journal's events tell of plans and runs, to hold their tables against it."""

from __future__ import annotations

import json
import sqlite3
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final

from pydantic import ValidationError

from app.domain.events import EventKind
from app.domain.plan.identity import document_hash
from app.domain.run import Run
from app.domain.run_fold import RunFold

_PLAN_COLUMNS: Final = ("hash", "name", "vehicle_type", "created_at", "created_by")
_RUN_KINDS: Final = frozenset(
    {
        EventKind.RUN_CREATED,
        EventKind.RUN_CHANGED,
        EventKind.RUN_CONTINUED,
        EventKind.RUN_DROP,
        EventKind.RUN_UPLOAD_PROGRESS,
    }
)
_RUN_COLUMNS: Final = ("plan_id", "vehicle_id", "is_over", "state", "created_at")


class Told:
    """Filled event by event, in order. A plan and a run are stored in one transaction with what tells of them."""

    def __init__(self) -> None:
        self._plans: dict[str, dict[str, Any]] = {}
        self._runs: defaultdict[str, RunFold] = defaultdict(RunFold)
        self._attachments: dict[str, list[str]] = {}
        self._flown: defaultdict[str, set[str]] = defaultdict(set)
        self._jobs: dict[str, dict[str, Any]] = {}

    def take(self, kind: str, run_id: str | None, data: str) -> None:
        """One event. `data` is its JSON text."""
        if kind == EventKind.PLAN_CREATED:
            told = object_of(data)
            self._plans[str(told.get("plan_id"))] = told
        elif kind == EventKind.RUN_ATTACHMENT:
            told = object_of(data)
            where = f"attachment {told.get('name')} of drop {told.get('plan_item_id')} of run {run_id}"
            self._attachments.setdefault(str(told.get("sha256")), []).append(where)
        elif kind == EventKind.JOB_CHANGED:
            job = object_of(data).get("job")
            if isinstance(job, dict):
                self._jobs[str(job.get("id"))] = job
        elif run_id is not None and kind in _RUN_KINDS:
            told = object_of(data)
            self._runs[run_id].take(kind, told)
            if "plan_hash" in told:  # a run that was changed in flight flew several plans
                self._flown[str(told.get("plan_id"))].add(str(told["plan_hash"]))

    def altered_plans(self, rows: Iterable[sqlite3.Row]) -> Iterator[str]:
        """Plans that are not the ones that were posted, or not the ones that a run flew."""
        missing, flown = dict(self._plans), self._flown
        for row in rows:
            told = missing.pop(row["id"], None)
            if told is None:
                yield f"plan {row['id']} is told of by no event"
                continue
            document = object_of(row["document"])
            known = {name: told[name] for name in _PLAN_COLUMNS if name in told}  # the first versions told less
            same = all(row[name] == value for name, value in known.items())
            same = same and _is_document(document, row) and flown.get(row["id"], {row["hash"]}) == {row["hash"]}
            if not same:
                yield f"plan {row['id']} is not the one that was posted"
        for plan_id in missing:
            yield f"plan {plan_id} was posted, and is missing"

    def altered_runs(self, rows: Iterable[sqlite3.Row]) -> Iterator[str]:
        """Runs that are not as their events left them, in the document or in the columns that are searched."""
        missing = dict(self._runs)
        for row in rows:
            fold = missing.pop(row["id"], None)
            if fold is None or not fold.is_told:
                yield f"run {row['id']} is told of by no event"
                continue
            differing = _differences(row, fold)
            if differing:
                yield f"run {row['id']} is not as its events left it: {', '.join(differing)}"
        for run_id in missing:
            yield f"run {run_id} is told of by events, and is missing"

    def altered_jobs(self, rows: Iterable[sqlite3.Row]) -> Iterator[str]:
        """Jobs that are not as their newest event left them."""
        missing = dict(self._jobs)
        for row in rows:
            told = missing.pop(row["id"], None)
            if told is None:
                yield f"job {row['id']} is told of by no event"
            elif object_of(row["document"]) != told or row["state"] != told.get("state"):
                yield f"job {row['id']} is not as its events left it"
        for job_id in missing:
            yield f"job {job_id} is told of by events, and is missing"

    @property
    def attachments(self) -> int:
        """How many files were told of."""
        return len(self._attachments)

    def altered_attachments(self, is_intact: Callable[[str], bool]) -> Iterator[str]:
        """Attachments whose file is not the one that was attached; `is_intact` looks at a file by its SHA-256."""
        for sha256, where in self._attachments.items():
            if not is_intact(sha256):
                yield from (f"{one}: the file {sha256} is missing or is not the one that was attached" for one in where)


def object_of(text: object) -> dict[str, Any]:
    """The JSON object in a column, empty if there is none: a check must not end at rubbish."""
    try:
        value = json.loads(text) if isinstance(text, str) else None
    except (ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}


def _is_document(document: dict[str, Any], row: sqlite3.Row) -> bool:
    try:
        hashed = document_hash(document)
    except (ValueError, RecursionError):
        return False
    return hashed == row["hash"] and (document.get("name"), document.get("vehicle_type")) == (
        row["name"],
        row["vehicle_type"],
    )


def _differences(row: sqlite3.Row, fold: RunFold) -> list[str]:
    """What differs, by name. Both are read by the same model, so a field that a version added counts as its default."""
    told = fold.run()
    if told is None:
        return ["its events cannot be read by this version"]
    try:
        stored = Run.model_validate(object_of(row["document"]))
    except ValidationError:
        return ["it cannot be read"]
    exempt = set() if fold.knows_when else {"updated_at"}
    fields = [name for name in Run.model_fields if getattr(told, name) != getattr(stored, name) and name not in exempt]
    there = set(row.keys())  # a journal that an older version wrote has fewer
    columns = [name for name in _RUN_COLUMNS if name in there and row[name] != getattr(told, name)]
    return sorted({*fields, *columns})
