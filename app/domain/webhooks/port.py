"""What webhooks need of the world: somebody who sends, and a place to keep them: webhooks/ and storage/."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from app.domain.webhooks.hook import Progress, StoredWebhook, Webhook


@dataclass(frozen=True, slots=True)
class Reply:
    """How one request ended. `status` is None if no HTTP answer came; `problem` then says why.

    `retry_after_s` is the receiver's Retry-After in seconds, if it gave one that can be read.
    """

    status: int | None
    problem: str = ""
    retry_after_s: float | None = None

    @property
    def is_good(self) -> bool:
        """Whether the receiver has it: any 2xx."""
        return self.status is not None and 200 <= self.status < 300


class WebhookSender(Protocol):
    """Sends one request. No redirect is followed, nothing of the answer but its status is read."""

    async def post(self, url: str, headers: Mapping[str, str], body: bytes) -> Reply:
        """POST `body`. Never raises for what a receiver or the network does; ends within the sender's time limit."""


class WebhookStore(Protocol):
    """Webhooks on disk. Each method may raise StorageError."""

    async def add(self, stored: StoredWebhook) -> None:
        """Store a new one."""

    async def list_webhooks(self) -> Sequence[StoredWebhook]:
        """All, oldest first."""

    async def change(self, hook: Webhook) -> None:
        """Store what an administrator changed; the secret and the progress stay."""

    async def save_progress(self, hook_id: str, progress: Progress) -> None:
        """Store how far it has come; nothing happens if it is gone."""

    async def delete(self, hook_id: str) -> None:
        """Forget it."""
