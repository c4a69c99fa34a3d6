"""Plans: checked, accepted, stored, and returned with findings and prediction."""

from __future__ import annotations

import asyncio
import secrets
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from app.domain.errors import NotFoundError, PlanRejectedError
from app.domain.events import NewEvent
from app.domain.events.service import PlanCreated
from app.domain.model import Frozen
from app.domain.plan import Plan, PlanInvalid, parse_plan
from app.domain.ports.journal import EventJournal
from app.domain.ports.stores import AnswerTo, PlanStore, StoredPlan
from app.domain.ports.threads import InThread
from app.domain.prediction import CALM, Timeline, Wind
from app.domain.rules import Finding, Severity
from app.domain.vehicle.state import VehicleProfile, VehicleType
from app.services.clock import Clock
from app.services.plan_checks import PlanCheck, check, check_and_hash, check_as_json, is_plan
from app.services.plan_work import PlanWork

KEPT: Final = 64


@dataclass(frozen=True, slots=True)
class KnownPlan:
    """A plan, parsed, and what it was stored as."""

    id: str
    hash: str
    plan: Plan


class KnownPlans:
    """The stored plans, parsed."""

    def __init__(self, store: PlanStore, in_thread: InThread = asyncio.to_thread) -> None:
        """`in_thread` parses those that are asked for by id, as flights do."""
        self._store = store
        self._in_thread = in_thread
        self._kept: OrderedDict[str, KnownPlan] = OrderedDict()

    async def stored(self, plan_id: str) -> StoredPlan:
        """One plan as it was accepted, neither checked anew nor predicted. Raises NotFoundError, StorageError."""
        stored = await self._store.get(plan_id)
        if stored is None:
            raise NotFoundError(f"no plan {plan_id!r}", hint="list the plans to see their IDs")
        return stored

    async def known(self, plan_id: str) -> KnownPlan:
        """One plan. Raises NotFoundError, PlanInvalid (another version accepted it), StorageError."""
        known = self._kept.get(plan_id)
        return await self._read(await self.stored(plan_id), self._in_thread) if known is None else self.keep(known)

    async def read(self, stored: StoredPlan) -> KnownPlan:
        """Parse a stored plan. Raises PlanInvalid."""
        return await self._read(stored, asyncio.to_thread)

    async def _read(self, stored: StoredPlan, in_thread: InThread) -> KnownPlan:
        known = self._kept.get(stored.id)
        if known is None:
            known = KnownPlan(stored.id, stored.hash, await in_thread(parse_plan, stored.document))
        return self.keep(known)

    def keep(self, known: KnownPlan) -> KnownPlan:
        """It was used just now."""
        self._kept[known.id] = known
        self._kept.move_to_end(known.id)
        if len(self._kept) > KEPT:
            self._kept.popitem(last=False)
        return known

    def forget(self) -> Sequence[str]:
        """Keep none any longer; the ids of those that were kept."""
        kept = tuple(self._kept)
        self._kept.clear()
        return kept

    async def list_plans(self, limit: int, older_than: str | None = None) -> Sequence[StoredPlan]:
        """Newest first. Raises NotFoundError if `older_than` is no plan, StorageError."""
        if older_than is not None:
            await self.stored(older_than)
        return await self._store.list_plans(limit=limit, older_than=older_than)


CACHED_VIEWS: Final = 32


class PlanHead(Frozen):
    """A stored plan without its document. `hash` is the SHA-256 of the document, `created_at` Unix seconds."""

    id: str
    hash: str
    name: str
    vehicle_type: VehicleType
    created_at: float
    created_by: str


class PlanView(PlanHead):
    """A stored plan: the document as normalised, and what this version finds in it and predicts of it."""

    plan: dict[str, Any]
    findings: tuple[Finding, ...]
    timeline: Timeline | None


@dataclass(frozen=True, slots=True)
class NewPlan:
    """A plan that was checked and is stored nowhere yet; `created` announces it, and is stored in the same step."""

    stored: StoredPlan
    plan: Plan
    created: NewEvent
    check: PlanCheck


class Plans:
    """Accepts plans and gives them back. A plan never changes, so its view is worked out once and kept a while."""

    def __init__(self, known: KnownPlans, journal: EventJournal, clock: Clock, work: PlanWork | None = None) -> None:
        self.work = work or PlanWork()
        self._known = known
        self._journal = journal
        self._clock = clock
        self._views: OrderedDict[str, PlanView] = OrderedDict()
        self._pruned = journal.pruned
        self._adopting = asyncio.Lock()

    async def check(self, plan: Plan, facts: VehicleProfile | None = None, wind: Wind = CALM) -> PlanCheck:
        """Findings and timeline for a vehicle, or for the type's defaults."""
        return await self.work.run(plan, check, plan, facts, wind)

    async def is_plan(self, document: object) -> bool:
        """Whether the output of a JSON reader is a plan."""
        return await self.work.run(document, is_plan, document)

    async def check_as_json(self, document: object, facts: VehicleProfile | None, wind: Wind = CALM) -> bytes:
        """The PlanCheck of the output of a JSON reader, which need not be a plan, as JSON."""
        return await self.work.run(document, check_as_json, document, facts, wind)

    async def create(self, plan: Plan, actor: str, answer: AnswerTo[PlanView] | None = None) -> PlanView:
        """Store a plan that has no errors; the same document twice makes two plans with one hash. `answer`: stored in
        the same commit.

        Raises:
            PlanRejectedError: a rule found an error; `extra["findings"]` has all findings.
            StorageError: it is not stored, or was stored and could not be announced.
        """
        new = await self.checked(plan, actor)
        view = _view(new.stored, new.check)
        answers = () if answer is None else (answer(view),)
        await self._journal.record(new.created, plans=(new.stored,), answers=answers)
        return self._keep(view)

    async def checked(self, plan: Plan, actor: str) -> NewPlan:
        """A plan that has no errors, to be stored by whoever needs it: an order that is refused leaves none behind.

        Raises PlanRejectedError.
        """
        found, hashed = await self.work.run(plan, check_and_hash, plan)
        if found.has_errors:
            raise _rejected(found.findings)
        stored = StoredPlan(
            id=f"plan-{secrets.token_hex(6)}",
            hash=hashed,
            name=plan.name,
            vehicle_type=plan.vehicle_type,
            created_at=self._clock.now(),
            created_by=actor,
            document=plan.model_dump(mode="json"),
        )
        self._known.keep(KnownPlan(stored.id, stored.hash, plan))
        return NewPlan(stored, plan, self._created(stored), found)

    async def adopt(self, stored: StoredPlan) -> None:
        """Store a plan that another part of the cluster has accepted, with the event that announces it, if it is new
        here. Raises StorageError.
        """
        async with self._adopting:
            try:
                await self._known.stored(stored.id)
            except NotFoundError:
                await self._journal.record(self._created(stored), plans=(stored,))

    async def get(self, plan_id: str) -> PlanView:
        """One plan. Raises NotFoundError, StorageError."""
        if self._journal.pruned != self._pruned:  # another node may have deleted some
            self._pruned = self._journal.pruned
            self._views.clear()
        if plan_id in self._views:
            return self._keep(self._views[plan_id])
        return self._keep(await self._view_of(await self._known.stored(plan_id)))

    async def stored(self, plan_id: str) -> StoredPlan:
        """One plan as it was accepted, neither checked anew nor predicted. Raises NotFoundError, StorageError."""
        return await self._known.stored(plan_id)

    async def known(self, plan_id: str) -> KnownPlan:
        """One plan and its hash. Raises as `plan`."""
        return await self._known.known(plan_id)

    async def plan(self, plan_id: str) -> Plan:
        """Return the plan. Raises NotFoundError, PlanInvalid (another version accepted it), StorageError."""
        return (await self._known.known(plan_id)).plan

    async def read(self, stored: StoredPlan) -> Plan:
        """Parse a stored plan. Raises PlanInvalid."""
        return (await self._known.read(stored)).plan

    def _created(self, stored: StoredPlan) -> NewEvent:
        created = PlanCreated(
            plan_id=stored.id,
            hash=stored.hash,
            name=stored.name,
            vehicle_type=stored.vehicle_type,
            created_at=stored.created_at,
            created_by=stored.created_by,
        )
        return self._journal.new_event(created)

    def in_use(self) -> Sequence[str]:
        """The plans that were used since this was last asked. They are read anew: others may be deleted by age."""
        self._views.clear()
        return self._known.forget()

    async def list_plans(self, limit: int, older_than: str | None = None) -> Sequence[PlanHead]:
        """Newest first, without their documents: to predict each of them takes too long for a list.

        Raises NotFoundError if `older_than` is no plan, StorageError.
        """
        found = await self._known.list_plans(limit, older_than)
        return [PlanHead.model_validate(plan, from_attributes=True) for plan in found]

    async def _view_of(self, stored: StoredPlan) -> PlanView:
        try:
            found = await self.check((await self._known.read(stored)).plan)
        except PlanInvalid as error:  # accepted by another version, which took what this one does not
            found = PlanCheck(findings=error.findings, timeline=None)
        return _view(stored, found)

    def _keep(self, view: PlanView) -> PlanView:
        self._views[view.id] = view
        self._views.move_to_end(view.id)
        if len(self._views) > CACHED_VIEWS:
            self._views.popitem(last=False)
        return view


def _view(stored: StoredPlan, check: PlanCheck) -> PlanView:
    return PlanView(
        id=stored.id,
        hash=stored.hash,
        name=stored.name,
        vehicle_type=stored.vehicle_type,
        created_at=stored.created_at,
        created_by=stored.created_by,
        plan=stored.document,
        findings=check.findings,
        timeline=check.timeline,
    )


def _rejected(findings: Sequence[Finding]) -> PlanRejectedError:
    errors = [finding for finding in findings if finding.severity is Severity.ERROR]
    return PlanRejectedError(
        f"the plan has {len(errors)} error{'s' if len(errors) > 1 else ''}: {errors[0].message}",
        hint=errors[0].hint,
        findings=[finding.model_dump(mode="json") for finding in findings],
    )
