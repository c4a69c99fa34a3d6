"""What strangers and broken clients cause is bounded, and a disk that fails keeps nobody from working."""

from __future__ import annotations

from collections.abc import AsyncIterator, Sequence

import pytest

from app.domain.audit import AuditFilter, AuditOutcome, RejectedRequests
from app.domain.errors import StorageError
from app.domain.ports.stores import StoredToken
from app.services.access import Principal, Role
from app.services.audit import MOST_WAITING, Audit
from app.services.journal import Journal
from tests.support.fakes import ManualClock, MemoryEventStore
from tests.support.service_in_process import until

DESK = Principal("desk", Role.DISPATCHER, "token-1")


class Refusals:
    """RefusalStore in a list."""

    def __init__(self) -> None:
        self.rows: list[RejectedRequests] = []
        self.writes = 0
        self.full = False

    async def add(self, refusals: Sequence[RejectedRequests]) -> None:
        """See RefusalStore."""
        if self.full and refusals:
            raise StorageError("the disk is full")
        self.writes += bool(refusals)
        self.rows += refusals

    async def newest(self, *, before: int | None, limit: int) -> Sequence[tuple[int, RejectedRequests]]:
        """See RefusalStore."""
        found = [(number, row) for number, row in enumerate(self.rows, 1) if before is None or number < before]
        return found[::-1][:limit]


class Tokens:
    """TokenStore with two tokens, of which one is revoked."""

    async def list_tokens(self) -> Sequence[StoredToken]:
        """See TokenStore."""
        return [
            StoredToken("token-1", "desk", "pilot", "h1", created_at=10.0),
            StoredToken("token-2", "lost", "admin", "h2", created_at=20.0, revoked_at=40.0),
        ]


@pytest.fixture
def events() -> MemoryEventStore:
    return MemoryEventStore()


@pytest.fixture
def refusals() -> Refusals:
    return Refusals()


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock(30.0)


@pytest.fixture
async def journal(events: MemoryEventStore, clock: ManualClock) -> AsyncIterator[Journal]:
    journal = Journal(events, clock)
    await journal.start()
    yield journal
    await journal.close()


@pytest.fixture
def audit(journal: Journal, refusals: Refusals, clock: ManualClock) -> Audit:
    return Audit(journal, refusals, Tokens(), clock)  # type: ignore[arg-type]


async def test_what_is_alike_is_one_line_with_its_number(audit: Audit, refusals: Refusals) -> None:
    async with audit.recording():
        for number in range(1000):
            audit.refuse(DESK, "10.0.0.1", "start_run", "/runs/1", 409, "run.wrong_state")
            audit.refuse(None, "10.0.0.9", "start_run", f"/runs/{number}", 401, "auth.required")
    assert [(row.actor, row.count) for row in refusals.rows] == [("desk", 1000), ("", 1000)]
    assert refusals.writes == 1


async def test_many_different_strangers_take_neither_memory_nor_the_disk(audit: Audit, refusals: Refusals) -> None:
    async with audit.recording():
        for number in range(10 * MOST_WAITING):
            audit.refuse(None, f"10.0.{number >> 8}.{number & 255}", "x", "/x", 401, "auth.required")
    assert len(refusals.rows) == MOST_WAITING


async def test_a_disk_that_fails_loses_these_lines_and_no_later_ones(audit: Audit, refusals: Refusals) -> None:
    refusals.full = True
    async with audit.recording():
        audit.refuse(DESK, "10.0.0.1", "start_run", "/runs/1", 409, "run.wrong_state")
        await until(lambda: audit.waiting == 0)
        refusals.full = False
        audit.refuse(DESK, "10.0.0.1", "start_run", "/runs/2", 409, "run.wrong_state")
    assert [row.target for row in refusals.rows] == ["/runs/2"]


async def test_an_accepted_request_that_cannot_be_recorded_stays_accepted(
    audit: Audit, events: MemoryEventStore
) -> None:
    events.failures = [StorageError("the disk is full")]
    await audit.accept(DESK, "start_run", "/runs/1")
    await audit.accept(DESK, "start_run", "/runs/2")
    assert len(events.events) == 1


async def test_all_three_sources_are_one_list_in_the_order_of_time(audit: Audit, clock: ManualClock) -> None:
    async with audit.recording():
        await audit.accept(DESK, "create_plan", "/plans")
        clock.time_s = 35.0
        audit.refuse(DESK, "10.0.0.1", "start_run", "/runs/1", 502, "vehicle.link")
    whole, following = await audit.page(AuditFilter(), limit=10, cursor=None)
    assert following is None
    assert [(entry.time, entry.action, entry.outcome) for entry in whole] == [
        (40.0, "revoke_token", AuditOutcome.ACCEPTED),
        (35.0, "start_run", AuditOutcome.FAILED),
        (30.0, "create_plan", AuditOutcome.ACCEPTED),
        (20.0, "create_token", AuditOutcome.ACCEPTED),
        (10.0, "create_token", AuditOutcome.ACCEPTED),
    ]
    paged, cursor = [], None
    for _ in range(5):
        page, cursor = await audit.page(AuditFilter(), limit=1, cursor=cursor)
        paged += page
    assert paged == whole
    assert await audit.page(AuditFilter(), limit=1, cursor=cursor) == ([], None)
