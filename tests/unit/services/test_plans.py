"""A plan without errors is stored and announced; one with errors is refused whole."""

from __future__ import annotations

import copy
from collections.abc import AsyncIterator, Sequence
from dataclasses import replace
from typing import Any

import pytest

from app.domain.errors import NotFoundError, PlanRejectedError, StorageError
from app.domain.events import EventKind
from app.domain.events.service import JournalPruned
from app.domain.plan import Plan, parse_plan, plan_hash
from app.domain.ports.stores import StoredPlan
from app.domain.rules import default_facts
from app.domain.vehicle.state import VehicleType
from app.services.journal import Journal
from app.services.plans import CACHED_VIEWS, KnownPlans, Plans
from tests.support.events import data_of
from tests.support.fakes import ManualClock, MemoryEventStore

DOCUMENT: dict[str, Any] = {
    "version": 1,
    "name": "Clinic run",
    "vehicle_type": "multicopter",
    "home": {"latitude_deg": 47.3977, "longitude_deg": 8.5456, "absolute_altitude_m": 488.0},
    "items": [
        {"id": "up", "type": "takeoff", "relative_altitude_m": 15},
        {"id": "yard", "type": "waypoint", "latitude_deg": 47.398, "longitude_deg": 8.546, "relative_altitude_m": 15},
        {"id": "drop", "type": "gripper", "action": "release", "release_motion": "stopped"},
        {"id": "home", "type": "return_to_launch"},
    ],
}


class MemoryPlanStore:
    """PlanStore over what the event store was given."""

    def __init__(self, plans: dict[str, StoredPlan]) -> None:
        self.plans = plans
        self.reads = 0

    async def get(self, plan_id: str) -> StoredPlan | None:
        """See PlanStore."""
        self.reads += 1
        return self.plans.get(plan_id)

    async def list_plans(self, *, limit: int, older_than: str | None = None) -> Sequence[StoredPlan]:
        """See PlanStore."""
        return list(self.plans.values())[::-1][:limit]


def a_plan(name: str = "Clinic run") -> Plan:
    return parse_plan({**DOCUMENT, "name": name})


def a_bad_plan() -> Plan:
    document = copy.deepcopy(DOCUMENT)
    document["items"][2]["release_motion"] = "moving"
    del document["items"][1]
    return parse_plan(document)


@pytest.fixture
def events() -> MemoryEventStore:
    return MemoryEventStore()


@pytest.fixture
def store(events: MemoryEventStore) -> MemoryPlanStore:
    return MemoryPlanStore(events.plans)


@pytest.fixture
async def plans(store: MemoryPlanStore, events: MemoryEventStore) -> AsyncIterator[Plans]:
    clock = ManualClock(1234.5)
    journal = Journal(events, clock)
    await journal.start()
    yield Plans(KnownPlans(store), journal, clock)
    await journal.close()


async def test_a_good_plan_is_stored_and_shown_with_its_prediction(plans: Plans, store: MemoryPlanStore) -> None:
    view = await plans.create(a_plan(), actor="ward 3")
    assert view.id.startswith("plan-")
    assert (view.hash, view.name, view.vehicle_type) == (plan_hash(a_plan()), "Clinic run", VehicleType.MULTICOPTER)
    assert (view.created_at, view.created_by) == (1234.5, "ward 3")
    assert parse_plan(view.plan) == a_plan()
    assert view.timeline is not None
    assert view.timeline.order == ("up", "yard", "drop", "home")
    assert store.plans[view.id].document == view.plan


async def test_a_new_plan_is_announced(plans: Plans, events: MemoryEventStore) -> None:
    view = await plans.create(a_plan(), actor="ward 3")
    (event,) = events.events
    assert event.kind is EventKind.PLAN_CREATED
    assert data_of(event) == {
        "plan_id": view.id,
        "hash": view.hash,
        "name": view.name,
        "vehicle_type": "multicopter",
        "created_at": 1234.5,
        "created_by": "ward 3",
    }


async def test_a_plan_with_an_error_is_refused_with_all_findings(
    plans: Plans, store: MemoryPlanStore, events: MemoryEventStore
) -> None:
    with pytest.raises(PlanRejectedError) as refused:
        await plans.create(a_bad_plan(), actor="ward 3")
    findings = refused.value.extra["findings"]
    check = await plans.check(a_bad_plan())
    assert findings == [finding.model_dump(mode="json") for finding in check.findings]
    assert findings
    assert refused.value.detail
    assert (store.plans, events.events) == ({}, [])


async def test_the_same_document_twice_makes_two_plans_with_one_hash(plans: Plans) -> None:
    first, second = await plans.create(a_plan(), actor="a"), await plans.create(a_plan(), actor="b")
    assert first.id != second.id
    assert first.hash == second.hash


async def test_a_plan_read_after_a_restart_is_shown_as_when_it_was_made(plans: Plans, store: MemoryPlanStore) -> None:
    view = await plans.create(a_plan(), actor="ward 3")
    journal = Journal(MemoryEventStore(), ManualClock())
    assert await Plans(KnownPlans(store), journal, ManualClock()).get(view.id) == view


async def test_a_plan_that_was_shown_lately_is_not_worked_out_again(plans: Plans, store: MemoryPlanStore) -> None:
    view = await plans.create(a_plan(), actor="ward 3")
    assert await plans.get(view.id) == view
    assert store.reads == 0
    for number in range(CACHED_VIEWS):
        await plans.create(a_plan(f"plan {number}"), actor="ward 3")
    assert await plans.get(view.id) == view
    assert store.reads == 1


async def test_a_plan_that_another_node_has_deleted_by_age_is_shown_no_more(
    store: MemoryPlanStore, events: MemoryEventStore
) -> None:
    journal = Journal(events, ManualClock())
    await journal.start()
    plans = Plans(KnownPlans(store), journal, ManualClock())
    view = await plans.create(a_plan(), actor="ward 3")
    await journal.record(
        journal.new_event(JournalPruned(up_to=1, chains=(), before=view.created_at + 1, attachments_before=None))
    )
    store.plans.clear()
    with pytest.raises(NotFoundError):
        await plans.get(view.id)
    await journal.close()


async def test_an_unknown_plan_is_not_found(plans: Plans) -> None:
    with pytest.raises(NotFoundError, match="plan-0"):
        await plans.get("plan-0")


async def test_plans_are_listed_newest_first(plans: Plans) -> None:
    for name in ("first", "second", "third"):
        await plans.create(a_plan(name), actor="ward 3")
    assert [head.name for head in await plans.list_plans(2)] == ["third", "second"]


async def test_a_stored_plan_that_this_version_does_not_take_is_shown_with_the_reasons(
    plans: Plans, store: MemoryPlanStore
) -> None:
    view = await plans.create(a_plan(), actor="ward 3")
    old = replace(store.plans[view.id], id="plan-old", document={**view.plan, "colour": "red"})
    store.plans[old.id] = old
    shown = await plans.get("plan-old")
    assert shown.plan == old.document
    assert shown.timeline is None
    assert [finding.pointer for finding in shown.findings] == ["/colour"]


async def test_a_plan_that_cannot_be_announced_is_not_made(plans: Plans, events: MemoryEventStore) -> None:
    events.failures.append(StorageError("the disk is full"))
    with pytest.raises(StorageError):
        await plans.create(a_plan(), actor="ward 3")
    assert events.plans == {}


async def test_a_check_against_a_vehicle_of_another_type_says_so_and_still_predicts(plans: Plans) -> None:
    check = await plans.check(a_plan(), default_facts(VehicleType.ROVER))
    assert check.has_errors
    assert check.timeline == (await plans.check(a_plan())).timeline


async def test_a_check_uses_what_the_vehicle_told(plans: Plans) -> None:
    facts = default_facts(VehicleType.MULTICOPTER)
    slow = replace(facts, parameters={**facts.parameters, "MPC_XY_CRUISE": 1})
    normal, slowed = [(await plans.check(a_plan(), given)).timeline for given in (facts, slow)]
    assert normal is not None
    assert slowed is not None
    assert slowed.duration_s > normal.duration_s


async def test_plans_that_are_in_use_are_told_once_and_deleted_ones_are_shown_no_more(
    plans: Plans, store: MemoryPlanStore
) -> None:
    view = await plans.create(a_plan(), actor="ward 3")
    assert await plans.get(view.id) == view
    assert (list(plans.in_use()), list(plans.in_use())) == ([view.id], [])
    store.plans.clear()
    with pytest.raises(NotFoundError):
        await plans.get(view.id)
