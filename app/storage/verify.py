"""Prove that a journal is as it was written: its chain of events, and the plans, runs and files that these name."""

from __future__ import annotations

import asyncio
import json
import sqlite3
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

from pydantic import ValidationError

from app.domain.errors import StorageError
from app.domain.events import EventKind, RunPayload, ServicePayload, payload_of, service
from app.domain.events import run as events
from app.domain.events.event import JournalHead, event_hash
from app.domain.events.run_fold import RunFold
from app.domain.jobs.job import Job
from app.domain.plan.document import document_hash
from app.domain.run.run import Run
from app.storage.attachments import attachments_folder, is_intact
from app.storage.database import no_journal, storage_errors
from app.storage.migrate import APPLICATION_ID

# Plans and runs as the events of a journal describe them, for comparison with their tables.


class Row(Protocol):
    """A row of a table, as drivers give it."""

    def __getitem__(self, name: str, /) -> Any: ...


_PLAN_COLUMNS: Final = ("hash", "name", "vehicle_type", "created_at", "created_by")
_RUN_COLUMNS: Final = ("plan_id", "vehicle_id", "is_over", "state", "created_at")


class JournalIndex:
    """Filled event by event, in order. A plan and a run are stored in one transaction with their events."""

    def __init__(self) -> None:
        self._plans: dict[str, service.PlanCreated] = {}
        self._runs: defaultdict[str, RunFold] = defaultdict(RunFold)
        self._attachments: dict[str, list[tuple[float, str]]] = {}
        self._used: defaultdict[str, set[str]] = defaultdict(set)
        self._jobs: dict[str, Job] = {}
        self._pruned: set[service.PrunedChain] = set()
        self._attachments_before = 0.0
        self.pruned_up_to = 0

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

    def _take_record(self, payload: ServicePayload) -> None:
        """What has a table of its own, and is no run."""
        match payload:
            case service.PlanCreated():
                self._plans[payload.plan_id] = payload
            case service.JobChanged(job=job):
                self._used[job.plan_id].add(job.plan_hash)
                if job.supersedes(self._jobs.get(job.id, job)):
                    self._jobs[job.id] = job
            case service.JournalPruned():
                self._pruned |= set(payload.chains)
                self.pruned_up_to = payload.up_to
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
                | service.JobQueueChanged()
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
                self._runs[run_id].take(payload)
            case events.RunDrop() | events.RunUploadProgress():
                self._runs[run_id].take(payload)
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

    def unexplained(self, gap: Gap) -> Iterator[str]:
        """What is wrong with a gap, unless retention has left it."""
        seq = gap.event["seq"]
        pruned = {chain.seq: chain.hash for chain in self._pruned if chain.gateway == gap.gateway}
        if (last := pruned.get(seq - 1)) is not None:
            if not _fits(gap.event, gap.gateway, JournalHead(seq=seq - 1, hash=last)):
                yield f"event {seq}: its hash does not follow from that of event {seq - 1}, which was deleted"
        elif gap.after or max(pruned, default=0) < seq:  # else more is to be deleted yet
            yield f"event {seq}: it does not follow event {gap.after}; the events between them are missing"

    def was_pruned(self, gateway: str, head: JournalHead) -> bool:
        """Whether a gateway's newest event was deleted by age."""
        return service.PrunedChain(gateway=gateway, seq=head.seq, hash=head.hash) in self._pruned

    def unknown(self, anchors: Iterable[JournalHead], gaps: Sequence[Gap]) -> Iterator[tuple[JournalHead, str]]:
        """What is wrong with anchors that no event has; an empty text if it was deleted, so that nobody can know."""
        hashes = {chain.hash for chain in self._pruned}
        for anchor in anchors:
            if not any(gap.after < anchor.seq < gap.event["seq"] for gap in gaps):
                yield anchor, f"event {anchor.seq} existed and is missing"
            elif anchor.hash not in hashes:
                yield anchor, ""

    def altered_plans(self, rows: Iterable[Row]) -> Iterator[str]:
        """Plans that are not the ones that were posted, or not the ones of their runs and jobs.

        The event of an old plan may have been deleted by age: then its runs and jobs say which plan it was.
        """
        missing, used = dict(self._plans), self._used
        for row in rows:
            recorded = missing.pop(row["id"], None)
            if recorded is None and not (self._pruned and row["id"] in used):
                yield f"plan {row['id']} is in no event"
                continue
            document = object_of(row["document"])
            same = recorded is None or all(row[name] == getattr(recorded, name) for name in _PLAN_COLUMNS)
            same = same and _is_document(document, row) and used.get(row["id"], {row["hash"]}) == {row["hash"]}
            if not same:
                yield f"plan {row['id']} differs from the created one"
        for plan_id in missing:
            yield f"plan {plan_id} was created and is missing"

    def altered_runs(self, rows: Iterable[Row]) -> Iterator[str]:
        """Runs that are not as their events left them, in the document or in the columns that are searched."""
        missing = {run_id: fold for run_id, fold in self._runs.items() if fold.run() is not None}
        for row in rows:
            fold = missing.pop(row["id"], None)
            if fold is None:
                yield f"run {row['id']} is in no event"
                continue
            differing = _differences(row, fold)
            if differing:
                yield f"run {row['id']} differs from its events: {', '.join(differing)}"
        for run_id in missing:
            yield f"run {run_id} exists in events and is missing"

    def altered_jobs(self, rows: Iterable[Row]) -> Iterator[str]:
        """Jobs that are not as their newest event left them."""
        missing = dict(self._jobs)
        for row in rows:
            recorded = missing.pop(row["id"], None)
            if recorded is None:
                yield f"job {row['id']} is in no event"
            elif object_of(row["document"]) != recorded.model_dump(mode="json") or row["state"] != recorded.state.value:
                yield f"job {row['id']} differs from its events"
        for job_id in missing:
            yield f"job {job_id} exists in events and is missing"

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
    """What differs, by name."""
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


_EVENTS: Final = "SELECT seq, kind, version, time, vehicle_id, run_id, data, hash FROM events ORDER BY seq"
_HASHED: Final = ("seq", "kind", "version", "time", "vehicle_id", "run_id", "data")


@dataclass(frozen=True, slots=True)
class Gap:
    """An event that does not have the seq after the one before it, `after`."""

    gateway: str
    event: Row
    after: int


class Chains:
    """The chains of gateways, filled event by event. `gaps` are events that do not follow the one before them."""

    def __init__(self) -> None:
        self.heads: defaultdict[str, JournalHead] = defaultdict(JournalHead)
        self.gaps: list[Gap] = []
        self.events = 0

    def take(self, gateway: str, event: Row) -> Iterator[str]:
        """Add an event; what is wrong with it."""
        head = self.heads[gateway]
        self.events += 1
        self.heads[gateway] = JournalHead(seq=event["seq"], hash=str(event["hash"]))
        if event["seq"] != head.seq + 1:
            self.gaps.append(Gap(gateway, event, head.seq))
        elif not _fits(event, gateway, head):
            yield f"event {event['seq']}: its hash is wrong: the event or the previous hash was altered"


@dataclass(frozen=True, slots=True)
class Verification:
    """The newest event of each chain, by the gateway that wrote it; the number of events, and of plans, runs and files
    that were compared with them; and the alterations.

    `journal` is the gateway, or the stream of a cluster, which has the chains of several. Each alteration is a sentence
    that names the event, plan, run or attachment. `unchecked` are anchors of events that were deleted by age.
    """

    journal: str
    heads: Mapping[str, JournalHead]
    events: int
    plans: int
    runs: int
    attachments: int
    alterations: Sequence[str]
    unchecked: Sequence[JournalHead] = ()


PROGRESS_EVENTS: Final = 10_000
Progress = Callable[[int, int], None]
"""How many events were checked, of how many. Called in another thread, every PROGRESS_EVENTS."""


async def verify_journal(
    path: Path, anchors: Sequence[JournalHead] = (), progress: Progress = lambda checked, total: None
) -> Verification:
    """Check the whole journal at `path`, also while a Waydrop runs on it. It is only read.

    The chain alone cannot show that its end was truncated, or that all of it was rewritten: `anchors` are hashes stored
    elsewhere, which the journal must contain.

    Raises:
        StorageError: there is no journal, an older Waydrop wrote it, or it cannot be read.
    """
    return await asyncio.to_thread(_verify, path, anchors, progress)


def _verify(path: Path, anchors: Sequence[JournalHead], progress: Progress) -> Verification:
    with storage_errors(path), _opened(path) as connection:
        connection.execute("BEGIN")  # one snapshot, whatever is written meanwhile
        row = connection.execute("SELECT id FROM gateway").fetchone()
        gateway = "" if row is None else str(row["id"])
        index, chains, found = JournalIndex(), Chains(), list[str]()
        missing = defaultdict[int, set[str]](set)
        for anchor in anchors:
            missing[anchor.seq].add(anchor.hash)
        total = connection.execute("SELECT count(*) FROM events").fetchone()[0]
        for event in connection.execute(_EVENTS):
            if chains.events % PROGRESS_EVENTS == 0:
                progress(chains.events, total)
            found += chains.take(gateway, event)
            if missing.pop(event["seq"], {event["hash"]}) != {event["hash"]}:
                found.append(f"event {event['seq']}: its hash differs from the anchor")
            if not index.take(event["kind"], event["version"], event["run_id"], event["data"]):
                found.append(f"event {event['seq']}: its data cannot be read")
        found += [text for gap in chains.gaps for text in index.unexplained(gap)]
        unknown = [anchor for anchor in anchors if anchor.seq in missing]
        lost = dict(index.unknown(sorted(unknown, key=lambda anchor: anchor.seq), chains.gaps))
        found += [text for text in lost.values() if text]
        found += index.altered_plans(connection.execute("SELECT * FROM plans ORDER BY position"))
        found += index.altered_runs(connection.execute("SELECT * FROM runs ORDER BY position"))
        found += index.altered_jobs(connection.execute("SELECT * FROM jobs ORDER BY position"))
        folder = attachments_folder(path)
        found += index.altered_attachments(lambda sha256: is_intact(folder, sha256))
        plans, runs = (connection.execute(f"SELECT count(*) FROM {name}").fetchone()[0] for name in ("plans", "runs"))
    unchecked = [anchor for anchor, text in lost.items() if not text]
    heads = {gateway: chains.heads[gateway]}
    return Verification(gateway, heads, chains.events, plans, runs, index.attachments, found, unchecked)


def _fits(event: Row, gateway: str, head: JournalHead) -> bool:
    try:
        hashed = event_hash(head.hash, gateway=gateway, **{name: event[name] for name in _HASHED})
    except (TypeError, ValueError):  # a blob, or an infinite time: nothing that was ever written
        return False
    return bool(hashed == event["hash"])


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    if not path.is_file():
        raise no_journal(path)
    # mode=ro: the leftovers of a killed process are read but not cleaned up
    uri = f"{path.absolute().as_uri()}?mode=ro"
    with closing(sqlite3.connect(uri, uri=True, timeout=5.0, isolation_level=None)) as connection:
        connection.row_factory = sqlite3.Row
        connection.text_factory = lambda text: text.decode("utf-8", "surrogateescape")
        connection.execute("PRAGMA query_only = ON")
        if connection.execute("PRAGMA application_id").fetchone()[0] != APPLICATION_ID:
            raise StorageError(f"{path} is a database of another program, not a journal")
        if not {*_HASHED, "hash"} <= {row["name"] for row in connection.execute("PRAGMA table_info(events)")}:
            raise StorageError(
                f"journal {path} was written by another version of Waydrop",
                hint="verify it with that version of Waydrop",
            )
        yield connection
