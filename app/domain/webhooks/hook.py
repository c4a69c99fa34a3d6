"""A webhook: where deliveries are told to, and how far that has come."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from pydantic import BaseModel, ConfigDict

from app.domain.reason import Reason
from app.domain.webhooks.lifecycle import DeliveryEvent

MAX_HOOKS: Final = 20
"""Each one has a task and reads the journal by itself."""


class Webhook(BaseModel):
    """What an administrator set. Times are Unix seconds; `events` empty: all.

    `disabled_reason` says why nothing is sent while `enabled` is false.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    id: str
    url: str
    events: tuple[DeliveryEvent, ...] = ()
    description: str = ""
    enabled: bool = True
    disabled_reason: Reason | None = None
    created_at: float
    created_by: str

    def wants(self, event: DeliveryEvent) -> bool:
        """Whether it is told of this."""
        return not self.events or event in self.events


class Progress(BaseModel):
    """How far a webhook has come, and how its last attempts went. Times are Unix seconds.

    `cursor` is the newest event of the journal that is done with: told and acknowledged, or of no interest.
    `failures` are attempts in a row that failed, since `failing_since`; `last_status` is the receiver's HTTP status,
    None if it gave none, and `last_problem` says why the last attempt did not count.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    cursor: int
    last_delivered_id: str | None = None
    last_delivered_at: float | None = None
    last_attempt_at: float | None = None
    last_status: int | None = None
    last_problem: str = ""
    failures: int = 0
    failing_since: float | None = None
    next_attempt_at: float | None = None

    def delivered(self, message_id: str, status: int, *, now: float) -> Progress:
        """After an attempt that the receiver acknowledged. The cursor moves when the whole event is done."""
        return Progress(
            cursor=self.cursor,
            last_delivered_id=message_id,
            last_delivered_at=now,
            last_attempt_at=now,
            last_status=status,
        )

    def failed(self, status: int | None, problem: str, *, now: float, retry_s: float | None) -> Progress:
        """After an attempt that did not count; `retry_s` is None if there will be no other."""
        changes: dict[str, object] = {
            "last_attempt_at": now,
            "last_status": status,
            "last_problem": problem,
            "failures": self.failures + 1,
            "failing_since": self.failing_since or now,
            "next_attempt_at": None if retry_s is None else now + retry_s,
        }
        return self.model_copy(update=changes)

    def moved_to(self, cursor: int) -> Progress:
        """With everything up to `cursor` done."""
        return self.model_copy(update={"cursor": cursor})


@dataclass(frozen=True, slots=True, repr=False)
class StoredWebhook:
    """A webhook with its secret: never shown, never logged."""

    hook: Webhook
    secret: str
    progress: Progress
