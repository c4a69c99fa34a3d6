"""The delivery report: the order, the flight, the outcome of each drop, and the events of the journal as evidence."""

from __future__ import annotations

from collections.abc import Container, Mapping
from typing import Any

from pydantic import ValidationError

from app.domain.drop.record import DropRecord
from app.domain.events import Event, EventKind, RunPayload
from app.domain.events import run as events
from app.domain.events.run_fold import RunFold
from app.domain.model import Frozen
from app.domain.plan.document import Order, document_hash
from app.domain.reasons import Reason
from app.domain.run.attachment import Attachment
from app.domain.run.run import LastPosition, PlanChange, Run, RunState
from app.domain.vehicle.link_security import LinkSecurity
from app.domain.vehicle.state import VehicleType


class ReportedPlan(Frozen):
    """The plan that was flown. `hash` is the SHA-256 of its canonical JSON when the run was created.

    `is_as_flown` says whether the stored plan still has this hash. If not, it was altered, and order, name and map
    cannot be trusted.
    """

    id: str
    hash: str
    is_as_flown: bool
    name: str | None = None
    order: Order | None = None


class EarlierPlan(Frozen):
    """A plan that the run flew until the plan was changed in flight, and its mission on board."""

    id: str
    hash: str
    mission_hash: str | None
    mission_id: int | None
    until: float
    changed_by: str


class ReportedVehicle(Frozen):
    """The vehicle as it reported itself when the run was created. `uid` is from AUTOPILOT_VERSION."""

    id: str
    uid: str | None
    vehicle_type: VehicleType | None
    firmware: str | None


class ReportedMission(Frozen):
    """The uploaded mission: SHA-256 of mission, geofence and rally points; PX4's CRC-32 of the mission, if reported."""

    hash: str | None
    id: int | None


class Entry(Frozen):
    """An event that the delivery report is based on. `seq` and `hash` identify its link in the journal's chain."""

    seq: int
    hash: str
    time: float
    kind: EventKind
    data: dict[str, Any]


class ReportedAttachment(Attachment):
    """An attachment, and whether the stored file matches the journal. `is_expired`: the file was deleted by age."""

    is_as_attached: bool
    is_expired: bool = False


class DeliveryReport(Frozen):
    """The delivery report of a run. Times are in Unix seconds. It may change until `is_final`; attachments may follow.

    `link_security` is the weakest protection that the vehicle's link had during the run: `signed`, `pinned` or `open`;
    null: not known. `last_position` is the newest position of the vehicle that was known as the run ended.
    `continues` is the run whose remaining items this run flew; `continued_by` is the run that flew the remaining items
    of this one, whose drops are reported there. `entries` are its commands, acknowledgements, drops and states, in
    order; without `is_whole`, the first of them were deleted by age. `waydrop verify-journal --anchor SEQ:HASH`
    verifies any of them against the journal.
    """

    gateway: str
    issued_at: float
    is_final: bool
    is_whole: bool = True
    run_id: str
    state: RunState
    reason: Reason | None
    requested_by: str
    created_at: float
    started_at: float | None
    ended_at: float | None
    last_position: LastPosition | None = None
    plan: ReportedPlan
    mission: ReportedMission
    earlier_plans: tuple[EarlierPlan, ...] = ()
    continues: str | None = None
    continued_by: str | None = None
    vehicle: ReportedVehicle
    link_security: LinkSecurity | None = None
    drops: tuple[DropRecord, ...]
    attachments: tuple[ReportedAttachment, ...]
    entries: tuple[Entry, ...]


class RunHistory:
    """Collects the entries of a run from its events, in order. Of the run itself, only state changes are included.

    `fold` is the run according to these events: the report relies on the chain, not on the table of runs.
    """

    def __init__(self) -> None:
        self.fold = RunFold()
        self.is_whole = False
        self.attachments: list[Attachment] = []
        self.earlier_plans: list[EarlierPlan] = []
        self._entries: list[Entry] = []
        self._state: tuple[RunState, Reason | None] | None = None

    def take(self, event: Event) -> None:
        """Add an event of the run."""
        self.is_whole = self.is_whole or event.kind is EventKind.RUN_CREATED
        self.fold.take(event.data)
        if isinstance(event.data, RunPayload):
            self._take(event, event.data)
        elif event.kind is EventKind.SIMULATOR_FAULT:
            self._add(event, event.data.model_dump(mode="json"))

    def _take(self, event: Event, payload: RunPayload) -> None:
        match payload:
            case events.RunMissionChanged(change=change):
                self._take_change(event, change)
            case events.RunTakenOver(root=run):
                self._add(event, {"taken_over": run.model_dump(mode="json")["taken_over"]})
            case events.RunContinued(root=run):
                self._add(event, {"continued_by": run.continued_by})
            case events.RunCreated(root=run) | events.RunChanged(root=run):
                self._take_state(event, run)
            case events.RunAttachment(root=attachment):
                self.attachments.append(attachment)
                self._add(event, attachment.model_dump(mode="json"))
            case (
                events.RunCommand()
                | events.RunAck()
                | events.RunDrop()
                | events.DropConsentAsked()
                | events.DropConsentClosed()
            ):
                self._add(event, payload.model_dump(mode="json"))
            case (
                events.RunPredicted()
                | events.RunPlanRefused()
                | events.RunUploadProgress()
                | events.RunTargetMoved()
                | events.RunTargetNotFollowed()
                | events.RunItem()
                | events.RunItemEnded()
            ):
                pass  # not evidence

    def _take_state(self, event: Event, run: Run) -> None:
        if (run.state, run.reason) != self._state:
            self._state = (run.state, run.reason)
            self._add(event, run.model_dump(mode="json", include={"state", "reason"}))

    def _take_change(self, event: Event, change: PlanChange) -> None:
        """The run flew another plan up to here. What was predicted for the new one is not evidence."""
        self._add(event, {"change": change.model_dump(mode="json")})
        if (run := self.fold.run()) is not None:
            self.earlier_plans.append(
                EarlierPlan(
                    id=run.plan_id,
                    hash=run.plan_hash,
                    mission_hash=run.mission_hash,
                    mission_id=run.mission_id,
                    until=event.time,
                    changed_by=change.actor,
                )
            )

    def entries(self) -> tuple[Entry, ...]:
        return tuple(self._entries)

    def _add(self, event: Event, data: dict[str, Any]) -> None:
        self._entries.append(Entry(seq=event.seq, hash=event.hash, time=event.time, kind=event.kind, data=data))


def report_of(
    run: Run,
    history: RunHistory,
    *,
    gateway: str,
    document: Mapping[str, Any],
    altered: Container[str],
    issued_at: float,
    attachments_before: float | None = None,
) -> DeliveryReport:
    """Build the delivery report from the events of a run.

    `document` is its stored plan; `altered` are the hashes of attachments whose files do not match.
    Files that were attached before `attachments_before` were deleted by age, unless they were attached again.
    """
    run = history.fold.run() or run
    return DeliveryReport(
        gateway=gateway,
        issued_at=issued_at,
        is_final=run.is_over,
        is_whole=history.is_whole,
        run_id=run.id,
        state=run.state,
        reason=run.reason,
        requested_by=run.requested_by,
        created_at=run.created_at,
        started_at=run.started_at,
        ended_at=run.ended_at,
        last_position=run.last_position,
        plan=_reported_plan(run, document),
        mission=ReportedMission(hash=run.mission_hash, id=run.mission_id),
        earlier_plans=tuple(history.earlier_plans),
        continues=run.continues,
        continued_by=run.continued_by,
        vehicle=ReportedVehicle(
            id=run.vehicle_id, uid=run.vehicle_uid, vehicle_type=run.vehicle_type, firmware=run.firmware
        ),
        link_security=run.link_security,
        drops=run.drops,
        attachments=tuple(
            ReportedAttachment(
                **dict(one),
                is_as_attached=one.sha256 not in altered,
                is_expired=one.sha256 in altered and attachments_before is not None and one.at < attachments_before,
            )
            for one in history.attachments
        ),
        entries=history.entries(),
    )


def _reported_plan(run: Run, document: Mapping[str, Any]) -> ReportedPlan:
    name = document.get("name")
    return ReportedPlan(
        id=run.plan_id,
        hash=run.plan_hash,
        is_as_flown=document_hash(document) == run.plan_hash,
        name=name if isinstance(name, str) else None,
        order=_order(document),
    )


def _order(document: Mapping[str, Any]) -> Order | None:
    """Return the plan's order; None if the plan is of another version that cannot be parsed."""
    try:
        return None if document.get("order") is None else Order.model_validate(document["order"])
    except ValidationError:
        return None
