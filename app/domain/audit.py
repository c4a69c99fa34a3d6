"""The audit log: who did what, and what was refused."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Protocol

from app.domain.model import Frozen

MOST_REFUSALS: Final = 5000
"""The newest that are kept of those with a token, and of those without one: strangers must not displace users."""


class AuditOutcome(StrEnum):
    """What became of a request or frame."""

    ACCEPTED = "accepted"
    REFUSED = "refused"
    FAILED = "failed"
    """The service or the vehicle could not do it (status 5xx)."""


@dataclass(frozen=True, slots=True)
class RejectedRequests:
    """Rejected requests that are alike. `actor` is empty if nobody was authenticated; `time` is of the first one."""

    time: float
    actor: str
    token_id: str
    address: str
    action: str
    target: str
    status: int
    code: str
    count: int = 1

    @property
    def outcome(self) -> AuditOutcome:
        """Refused, or failed."""
        return AuditOutcome.FAILED if self.status >= 500 else AuditOutcome.REFUSED


class AuditEntry(Frozen):
    """One line of the audit. `time` is Unix seconds.

    `action` is the API's operation, the type of an offboard frame, or create_token and revoke_token of the command
    line; `target` the path or the token. `seq` is the event of an accepted request, within the journal's chain.
    `count` requests were alike within a second; `address` is not stored of accepted ones.
    """

    time: float
    actor: str
    token_id: str
    address: str | None
    action: str
    target: str
    outcome: AuditOutcome
    status: int | None
    code: str | None
    count: int
    seq: int | None


@dataclass(frozen=True, slots=True)
class AuditFilter:
    """A filter; all given conditions must match. Times are Unix seconds, `since` inclusive and `before` exclusive."""

    actor: str | None = None
    outcome: AuditOutcome | None = None
    since: float | None = None
    before: float | None = None

    def wants(self, entry: AuditEntry) -> bool:
        return (
            self.actor in (None, entry.actor)
            and self.outcome in (None, entry.outcome)
            and (self.since is None or entry.time >= self.since)
            and (self.before is None or entry.time < self.before)
        )


class RefusalStore(Protocol):
    """Rejected requests on disk. Each method may raise StorageError."""

    async def add(self, refusals: Sequence[RejectedRequests]) -> None:
        """Store them; the oldest beyond MOST_REFUSALS are dropped."""

    async def newest(self, *, before: int | None, limit: int) -> Sequence[tuple[int, RejectedRequests]]:
        """With their positions, newest first; `before` is the position of the last one that was read."""
