"""Services that fail as they may fail, put in the place of the real ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from app.api import ApiServices
from app.domain.errors import StorageError
from app.domain.events import Event, NewEvent
from app.domain.ports.stores import StoredAnswer
from app.services.access import Access
from app.services.fleet import Fleet
from app.services.journal import Journal
from app.services.views import VehicleView


class BrokenDisk:
    """EventStore and AnswerStore on a disk that takes nothing."""

    async def append(
        self,
        events: Sequence[NewEvent],
        runs: Sequence[object] = (),
        plans: Sequence[object] = (),
        jobs: Sequence[object] = (),
        answers: Sequence[object] = (),
    ) -> Sequence[Event]:
        raise StorageError("no space left on the disk")

    async def read(self, *, after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        raise StorageError("the disk cannot be read")

    async def last_seq(self) -> int:
        return 0

    async def last_pruned(self) -> None:
        return None

    async def last_offboard(self) -> Sequence[Event]:
        raise StorageError("the disk cannot be read")

    async def get(self, key: str) -> StoredAnswer | None:
        return None

    async def put(self, answer: StoredAnswer, *, replaces: bool = False) -> None:
        raise StorageError("no space left on the disk")

    async def forget(self, key: str) -> None:
        raise StorageError("no space left on the disk")


class DefectiveFleet(Fleet):
    """A fleet with a bug."""

    def vehicles(self) -> Sequence[VehicleView]:
        secret = "a local variable"
        raise ZeroDivisionError(f"what nobody outside may read: {secret}")


class LockedAccess(Access):
    """Tokens that cannot be looked at."""

    async def has_tokens(self) -> bool:
        raise StorageError("the disk cannot be read")


def without_answers(services: ApiServices) -> ApiServices:
    """Answers cannot be kept."""
    return replace(services, answers=BrokenDisk())


def without_journal(services: ApiServices) -> ApiServices:
    """A journal that was never started: it takes nothing."""
    return replace(services, journal=Journal(BrokenDisk(), services.clock))


def without_tokens(services: ApiServices) -> ApiServices:
    """Who somebody is cannot be looked up."""
    locked = LockedAccess.__new__(LockedAccess)
    vars(locked).update(vars(services.access))
    return replace(services, access=locked)


def with_defect(services: ApiServices) -> ApiServices:
    """Listing the vehicles fails by a bug."""
    broken = DefectiveFleet.__new__(DefectiveFleet)
    broken.__dict__.update(services.fleet.__dict__)
    return replace(services, fleet=broken)


Change = Callable[[ApiServices], ApiServices]
