"""What a journal's events tell of plans and runs, to hold their tables against it."""

from __future__ import annotations

import json
import sqlite3
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final

from pydantic import ValidationError

from app.domain.events import AnyPayload, EventKind, payload_of
from app.domain.events.dispatch import JobChanged, PlanCreated
from app.domain.events.run import RunAttachment, RunChanged, RunContinued, RunCreated, RunDrop, RunUploadProgress
from app.domain.jobs.job import Job
from app.domain.plan.identity import document_hash
from app.domain.run import Run
from app.domain.run_fold import RunFold

_PLAN_COLUMNS: Final = ("hash", "name", "vehicle_type", "created_at", "created_by")
_RUN_COLUMNS: Final = ("plan_id", "vehicle_id", "is_over", "state", "created_at")


class Told:
    """Filled event by event, in order. A plan and a run are stored in one transaction with what tells of them."""

    def __init__(self) -> None:
        self._plans: dict[str, PlanCreated] = {}
        self._runs: defaultdict[str, RunFold] = defaultdict(RunFold)
        self._attachments: dict[str, list[str]] = {}
        self._flown: defaultdict[str, set[str]] = defaultdict(set)
        self._jobs: dict[str, Job] = {}

    def take(self, kind: object, version: object, run_id: str | None, data: object) -> bool:
        """One event as it is stored, `data` as its JSON text; False if it cannot be read."""
        try:
            told = payload_of(EventKind(str(kind)), int(str(version)), json.loads(str(data)))
        except (
            ValueError,
            RecursionError,
        ):  # a check must not end at rubbish
            return False
        match told:
            case PlanCreated():
                self._plans[told.plan_id] = told
            case RunAttachment(root=attachment):
                where = f"attachment {attachment.name} of drop {attachment.plan_item_id} of run {run_id}"
                self._attachments.setdefault(attachment.sha256, []).append(where)
            case JobChanged(job=job):
                self._jobs[job.id] = job
            case _ if run_id is not None:
                self._take_run(run_id, told)
            case _:
                pass  # tells of nothing that has a table
        return True

    def _take_run(self, run_id: str, told: AnyPayload) -> None:
        if isinstance(told, RunCreated | RunChanged | RunContinued):
            self._flown[told.root.plan_id].add(told.root.plan_hash)  # one changed in flight flew several plans
        elif not isinstance(told, RunDrop | RunUploadProgress):
            return
        self._runs[run_id].take(told)

    def altered_plans(self, rows: Iterable[sqlite3.Row]) -> Iterator[str]:
        """Plans that are not the ones that were posted, or not the ones that a run flew."""
        missing, flown = dict(self._plans), self._flown
        for row in rows:
            told = missing.pop(row["id"], None)
            if told is None:
                yield f"plan {row['id']} is told of by no event"
                continue
            document = object_of(row["document"])
            same = all(row[name] == getattr(told, name) for name in _PLAN_COLUMNS)
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
            if fold is None or fold.run() is None:
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
            elif object_of(row["document"]) != told.model_dump(mode="json") or row["state"] != told.state.value:
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
    """What differs, by name."""
    told = fold.run()
    if told is None:
        return ["no event tells of it"]
    try:
        stored = Run.model_validate(object_of(row["document"]))
    except ValidationError:
        return ["it cannot be read"]
    exempt = set() if fold.knows_when else {"updated_at"}
    fields = [name for name in Run.model_fields if getattr(told, name) != getattr(stored, name) and name not in exempt]
    columns = [name for name in _RUN_COLUMNS if row[name] != getattr(told, name)]
    return sorted({*fields, *columns})
