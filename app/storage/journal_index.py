"""Plans, runs, jobs and files as the events of a journal describe them, for comparison with their tables."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final

from pydantic import ValidationError

from app.domain.events import EventKind, RunPayload, ServicePayload, payload_of, service
from app.domain.events import run as events
from app.domain.events.event import JournalHead
from app.domain.events.run_fold import RunFold
from app.domain.jobs.job import Job
from app.domain.jobs.queue import VehicleQueue
from app.domain.plan.document import document_hash
from app.domain.run.run import Run
from app.storage.chains import Chains, Gap, Row, fits
from app.storage.dispatch import job_row
from app.storage.retention import MARGIN_S
from app.storage.run_folds import RunFolds

_PLAN_COLUMNS: Final = ("hash", "name", "vehicle_type", "created_at", "created_by")
_RUN_COLUMNS: Final = ("plan_id", "vehicle_id", "is_over", "state", "created_at")


class JournalIndex:
    """Filled event by event, in order. A plan and a run are stored in one transaction with their events."""

    def __init__(self) -> None:
        self._plans: dict[str, service.PlanCreated] = {}
        self._runs = RunFolds()
        self._attachments: dict[str, list[tuple[float, str]]] = {}
        self._used: defaultdict[str, set[str]] = defaultdict(set)
        self._jobs: dict[str, Job] = {}
        self._queued: set[str] = set()
        self._queues: dict[str, VehicleQueue] = {}
        self._pruned: set[service.PrunedChain] = set()
        self._before = 0.0
        self._attachments_before = 0.0
        self._left_over: set[str] = set()
        self.pruned_up_to = 0
        self.unproven: list[str] = []

    def take(self, kind: object, version: object, run_id: str | None, data: object) -> bool:
        """One event as it is stored, `data` as its JSON text; False if it cannot be read."""
        try:
            payload = payload_of(EventKind(str(kind)), int(str(version)), json.loads(str(data)))
        except (
            ValueError,
            RecursionError,
        ):  # a check must not end at rubbish
            return False
        if isinstance(payload, RunPayload):
            self._take_run(run_id or "", payload)
        elif isinstance(payload, ServicePayload):
            self._take_record(payload)
        return True

    def set_aside(self, event: Row) -> None:
        """An event that retention deletes next. It has deleted the one before: nothing proves the content."""
        job = object_of(event["data"]).get("job")
        self._left_over |= {str(event["run_id"]), str(job.get("id")) if isinstance(job, dict) else ""}
        self.unproven.append(f"event {event['seq']} is deleted by age next: nothing proves its content")

    def _take_record(self, payload: ServicePayload) -> None:
        """What has a table of its own, and is no run."""
        match payload:
            case service.PlanCreated():
                self._plans[payload.plan_id] = payload
            case service.JobChanged(change=change, job=job):
                if change == "queued":
                    self._queued.add(job.id)
                self._used[job.plan_id].add(job.plan_hash)
                if job.supersedes(self._jobs.get(job.id, job)):
                    self._jobs[job.id] = job
            case service.JobQueueChanged(queue=queue):
                self._queues[queue.vehicle_id] = queue
            case service.JournalPruned():
                self._pruned |= set(payload.chains)
                self.pruned_up_to = max(payload.up_to, self.pruned_up_to)
                self._before = max(payload.before or 0.0, self._before)
                self._attachments_before = payload.attachments_before or self._attachments_before
            case (
                service.ServiceStarted()
                | service.ServiceStopped()
                | service.LoopStalled()
                | service.SiteLeaseChanged()
                | service.LinkRefused()
                | service.RequestAccepted()
                | service.WebhookChanged()
                | service.SimulatorFault()
                | service.SimulatorSpeedSet()
            ):
                pass

    def _take_run(self, run_id: str, payload: RunPayload) -> None:
        match payload:
            case events.RunAttachment(root=attachment):
                where = f"attachment {attachment.name} of drop {attachment.plan_item_id} of run {run_id}"
                self._attachments.setdefault(attachment.sha256, []).append((attachment.at, where))
            case (
                events.RunCreated(root=run)
                | events.RunChanged(root=run)
                | events.RunContinued(root=run)
                | events.RunTakenOver(root=run)
            ):
                self._used[run.plan_id].add(run.plan_hash)  # one changed in flight flew several plans
                self._runs.take(run_id, payload)
            case events.RunDrop() | events.RunUploadProgress():
                self._runs.take(run_id, payload)
            case (
                events.RunPredicted()
                | events.RunPlanRefused()
                | events.RunMissionChanged()
                | events.RunTargetMoved()
                | events.RunTargetNotFollowed()
                | events.RunItem()
                | events.RunItemEnded()
                | events.RunCommand()
                | events.RunAck()
                | events.DropConsentAsked()
                | events.DropConsentClosed()
            ):
                pass

    def unexplained(self, gap: Gap, *, is_whole: bool) -> Iterator[str]:
        """What is wrong with a gap, unless retention has left it.

        `is_whole`: the store is the gateway's own, which lacks its beginning alone.
        """
        seq, pruned = gap.event["seq"], self._deleted(gap.gateway)
        missing = f"event {seq}: it does not follow event {gap.after}; the events between them are missing"
        if gap.after and is_whole:
            yield missing
        elif (last := pruned.get(seq - 1)) is not None:
            if not fits(gap.event, gap.gateway, JournalHead(seq=seq - 1, hash=last)):
                yield f"event {seq}: its hash does not follow from that of event {seq - 1}, which was deleted"
        elif gap.after or max(pruned, default=0) < seq:  # else more is to be deleted yet
            yield missing
        elif is_whole and seq in pruned:  # retention leaves it with the one before it, or not at all
            yield f"event {seq} was deleted by age and is there again: nothing proves its content"

    def is_left_over(self, gateway: str, first: Row) -> bool:
        """Whether the first event of a chain is deleted by age next, and follows no event that is recorded."""
        pruned = self._deleted(gateway)
        return 1 < first["seq"] <= max(pruned, default=0) and first["seq"] - 1 not in pruned

    def _deleted(self, gateway: str) -> dict[int, str]:
        """The hashes of events up to which all were deleted by age, or are to be."""
        return {chain.seq: chain.hash for chain in self._pruned if chain.gateway == gateway}

    def was_pruned(self, gateway: str, head: JournalHead) -> bool:
        """Whether a gateway's newest event was deleted by age."""
        return service.PrunedChain(gateway=gateway, seq=head.seq, hash=head.hash) in self._pruned

    def unknown(self, anchors: Iterable[JournalHead], chains: Chains) -> Iterator[tuple[JournalHead, str]]:
        """What is wrong with anchors that no event has; an empty text if it was deleted, so that nobody can know."""
        gone = [chain.seq for chain in self._pruned if chain.gateway not in chains.heads]
        for anchor in anchors:
            named = {chain.hash for chain in self._pruned if chain.seq == anchor.seq}
            if anchor.hash in named:
                continue
            if named and len(chains.heads) == 1:
                yield anchor, f"event {anchor.seq}: its hash differs from the anchor"
            elif any(gap.after < anchor.seq < gap.event["seq"] for gap in chains.gaps) or anchor.seq <= max(
                gone, default=0
            ):
                yield anchor, ""
            else:
                yield anchor, f"event {anchor.seq} existed and is missing"

    def altered_plans(self, rows: Iterable[Row]) -> Iterator[str]:
        """Plans that are not the ones that were posted, or not the ones of their runs and jobs.

        The event of an old plan may have been deleted by age: then its runs and jobs say which plan it was. Without
        them, the plan is deleted next, or it was: another part of a cluster may have announced it again.
        """
        missing, used, named = dict(self._plans), self._used, self._named_plans()
        for row in rows:
            recorded = missing.pop(row["id"], None)
            named.discard(row["id"])
            if recorded is None and not self._is_old_plan(row):
                yield f"plan {row['id']} is in no event"
                continue
            document = object_of(row["document"])
            same = recorded is None or all(row[name] == getattr(recorded, name) for name in _PLAN_COLUMNS)
            same = same and _is_document(document, row) and used.get(row["id"], {row["hash"]}) == {row["hash"]}
            if not same:
                yield f"plan {row['id']} differs from the created one"
        named |= {plan_id for plan_id, plan in missing.items() if plan.created_at >= self._before}
        for plan_id in sorted(named):
            yield f"plan {plan_id} was created and is missing"

    def _is_old_plan(self, row: Row) -> bool:
        """Whether the event of a plan may have been deleted by age."""
        made = row["created_at"]
        is_old = isinstance(made, float) and made < self._before + MARGIN_S
        return bool(self._pruned) and (row["id"] in self._used or is_old)

    def _named_plans(self) -> set[str]:
        """The plans of the runs and jobs that must be there."""
        return self._runs.plan_ids | {job.plan_id for job in self._jobs.values() if not self._may_be_deleted(job)}

    def _may_be_deleted(self, job: Job) -> bool:
        """Whether the end of a job was deleted by age, and later events of sites that had lost it were not: of one
        that is open, its first event is kept, too.
        """
        return bool(self._pruned) and not job.is_over and job.id not in self._queued

    def altered_runs(self, rows: Iterable[Row]) -> Iterator[str]:
        """Runs that are not as their events left them, in the document or in the columns that are searched."""
        missing = dict.fromkeys(self._runs.run_ids)
        for row in rows:
            if row["id"] not in missing:
                yield from self._in_no_event("run", row)
                continue
            del missing[row["id"]]
            differing = _differences(row, self._runs.get(row["id"]))
            if differing:
                yield f"run {row['id']} differs from its events: {', '.join(differing)}"
        for run_id in missing:
            yield f"run {run_id} exists in events and is missing"

    def _in_no_event(self, what: str, row: Row) -> Iterator[str]:
        if row["id"] in self._left_over:
            self.unproven.append(f"{what} {row['id']} is deleted by age next: nothing proves it")
        else:
            yield f"{what} {row['id']} is in no event"

    def altered_jobs(self, rows: Iterable[Row]) -> Iterator[str]:
        """Jobs that are not as their newest event left them."""
        missing = dict(self._jobs)
        for row in rows:
            recorded = missing.pop(row["id"], None)
            if recorded is None:
                yield from self._in_no_event("job", row)
            elif not _is_job(row, recorded):
                yield f"job {row['id']} differs from its events"
        for job in missing.values():
            if not self._may_be_deleted(job):
                yield f"job {job.id} exists in events and is missing"

    def altered_queues(self, rows: Iterable[Row]) -> Iterator[str]:
        """Queues of vehicles that are not as their newest event left them. Old events may have been deleted by age."""
        missing = dict(self._queues)
        for row in rows:
            recorded = missing.pop(row["vehicle_id"], None)
            if recorded is None and not self._pruned:
                yield f"the job queue of {row['vehicle_id']} is in no event"
            elif recorded is not None and object_of(row["document"]) != recorded.model_dump(mode="json"):
                yield f"the job queue of {row['vehicle_id']} differs from its events"
        for vehicle_id in missing:
            yield f"the job queue of {vehicle_id} exists in events and is missing"

    @property
    def attachments(self) -> int:
        """The number of files in the events."""
        return len(self._attachments)

    def altered_attachments(self, is_intact: Callable[[str], bool]) -> Iterator[str]:
        """Attachments whose file is not the one that was attached; `is_intact` looks at a file by its SHA-256."""
        for sha256, attached in self._attachments.items():
            kept = [where for at, where in attached if at >= self._attachments_before]
            if kept and not is_intact(sha256):
                yield from (f"{one}: the file {sha256} is missing or differs from the attached file" for one in kept)


def object_of(text: object) -> dict[str, Any]:
    """The JSON object in a column, empty if there is none: a check must not end at rubbish."""
    try:
        value = json.loads(text) if isinstance(text, str) else None
    except (ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}


def _is_job(row: Row, job: Job) -> bool:
    expected = {**job_row(job), "document": job.model_dump(mode="json")}
    return {**{name: row[name] for name in expected}, "document": object_of(row["document"])} == expected


def _is_document(document: dict[str, Any], row: Row) -> bool:
    try:
        hashed = document_hash(document)
    except (ValueError, RecursionError):
        return False
    return hashed == row["hash"] and (document.get("name"), document.get("vehicle_type")) == (
        row["name"],
        row["vehicle_type"],
    )


def _differences(row: Row, fold: RunFold) -> list[str]:
    run = fold.run()
    if run is None:
        return ["no event refers to it"]
    try:
        stored = Run.model_validate(object_of(row["document"]))
    except ValidationError:
        return ["it cannot be read"]
    exempt = set() if fold.knows_when else {"updated_at"}
    fields = [name for name in Run.model_fields if getattr(run, name) != getattr(stored, name) and name not in exempt]
    columns = [name for name in _RUN_COLUMNS if row[name] != getattr(run, name)]
    return sorted({*fields, *columns})
