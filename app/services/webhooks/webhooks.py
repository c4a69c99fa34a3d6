"""All webhooks: made, changed, tested and removed by administrators; each is delivered in a task of its own."""

from __future__ import annotations

import asyncio
import base64
import secrets
from collections.abc import Sequence
from typing import Any, Final

import structlog

from app.domain.errors import ConflictError, InvalidInputError, NotFoundError, WebhookSecretLostError
from app.domain.events.service import HookChange, WebhookChanged
from app.domain.ports.journal import EventJournal
from app.domain.ports.stores import PlanStore
from app.domain.reasons import Reason, ReasonCode
from app.domain.webhooks.lifecycle import DeliveryEvent
from app.domain.webhooks.message import Message
from app.domain.webhooks.webhook import (
    MAX_HOOKS,
    SECRET_PREFIX,
    Progress,
    StoredWebhook,
    Webhook,
    WebhookSender,
    WebhookStore,
    checked_url,
    host_of,
)
from app.services.background import end_tasks
from app.services.clock import Clock
from app.services.journal import first_seq, kept_after
from app.services.webhooks.delivery import DeliveryFeed, HookDelivery, ReceiverGoneError
from app.services.webhooks.views import (
    HookState,
    WebhookRequest,
    WebhookSettings,
    WebhookTestView,
    WebhookUpdate,
    WebhookView,
)

log = structlog.get_logger(__name__)
GONE_REASON: Final = Reason.of(ReasonCode.WEBHOOK_GONE)


class Webhooks:
    """The registry. Changes are made one after the other; a change ends a webhook's task and begins a new one.

    That holds for what a receiver changes, too: the journal tells changes in the order in which they were made.
    """

    def __init__(
        self,
        store: WebhookStore,
        plans: PlanStore,
        journal: EventJournal,
        sender: WebhookSender,
        clock: Clock,
        gateway_id: str,
        settings: WebhookSettings | None = None,
    ) -> None:
        self._store = store
        self._plans = plans
        self._journal = journal
        self._sender = sender
        self._clock = clock
        self._gateway_id = gateway_id
        self._settings = settings or WebhookSettings()
        self._deliveries: dict[str, HookDelivery] = {}
        self._secrets: dict[str, str | None] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._turn = asyncio.Lock()

    async def begin(self) -> None:
        """Continue where the last process stopped. Raises StorageError."""
        for stored in await self._store.list_webhooks():
            self._take(stored)

    async def close(self) -> None:
        """End all deliveries. A message in progress may be repeated after the next start, with the same ID.
        Idempotent.
        """
        await end_tasks(*self._tasks.values())

    async def create(self, request: WebhookRequest, *, actor: str) -> tuple[WebhookView, str]:
        """A new webhook and its secret, which nobody can ask for again.

        Raises InvalidInputError, ConflictError, EventsPrunedError.
        """
        async with self._turn:
            if len(self._deliveries) >= MAX_HOOKS:
                raise ConflictError(f"{MAX_HOOKS} webhooks exist, which is the limit", hint="delete an unused one")
            newest = self._journal.last_seq
            if request.after is not None and request.after > newest:
                raise InvalidInputError(f"after={request.after}: the journal's newest event is {newest}")
            hook = Webhook(
                id=f"hook-{secrets.token_hex(6)}",
                url=checked_url(request.url, http_anywhere=self._settings.http_anywhere),
                events=request.events,
                description=request.description,
                created_at=self._clock.now(),
                created_by=actor,
            )
            secret = SECRET_PREFIX + base64.b64encode(secrets.token_bytes(32)).decode("ascii")
            cursor = newest if request.after is None else kept_after(self._journal, request.after)
            stored = StoredWebhook(hook, secret, Progress(cursor=cursor))
            await self._record(hook, "created", actor)
            await self._store.add(stored)
            self._take(stored)
            return self._view(hook.id), secret

    async def list_webhooks(self) -> Sequence[WebhookView]:
        """All, oldest first."""
        return [self._view(hook_id) for hook_id in self._deliveries]

    async def get(self, hook_id: str) -> WebhookView:
        """One. Raises NotFoundError."""
        self._delivery(hook_id)
        return self._view(hook_id)

    async def change(self, hook_id: str, change: WebhookUpdate, *, actor: str) -> WebhookView:
        """Change the given fields. When enabled, it continues where it stopped. Raises NotFoundError,
        InvalidInputError.
        """
        async with self._turn:
            delivery = self._delivery(hook_id)
            hook = self._changed(delivery.hook, change, actor)
            await self._record(hook, _word(delivery.hook, hook), actor)
            await self._end(hook_id)
            try:
                await self._store.change(hook)
                if change.skip_missed:
                    delivery.skip_to(self._journal.last_seq)
                    await self._store.save_progress(hook_id, delivery.progress)
                delivery.change(hook)
            finally:  # also as it was, if the disk refuses the change
                self._take(StoredWebhook(delivery.hook, self._secrets[hook_id], delivery.progress))
            return self._view(hook_id)

    async def delete(self, hook_id: str, *, actor: str) -> None:
        """Remove it; a message under way is cut off. Raises NotFoundError."""
        async with self._turn:
            hook = self._delivery(hook_id).hook
            await self._record(hook, "deleted", actor)
            await self._store.delete(hook_id)
            await self._end(hook_id)
            del self._deliveries[hook_id], self._secrets[hook_id]

    async def test(self, hook_id: str) -> WebhookTestView:
        """Send a test message once, now, also to a disabled webhook. Raises NotFoundError, WebhookSecretLostError."""
        delivery = self._delivery(hook_id)
        if self._secrets[hook_id] is None:
            raise WebhookSecretLostError(
                f"the secret of webhook {hook_id} cannot be decrypted: its key file was lost or replaced",
                hint="restore the key file and restart, or delete the webhook and create it again",
            )
        message = Message(
            id=f"{self._gateway_id}:test-{secrets.token_hex(6)}",
            type=DeliveryEvent.TEST,
            time=self._clock.now(),
            gateway=self._gateway_id,
        )
        reply = await delivery.send_once(message)
        return WebhookTestView(
            delivered=reply.is_good, status=reply.status, problem=reply.problem, message_id=message.id
        )

    def _changed(self, hook: Webhook, change: WebhookUpdate, actor: str) -> Webhook:
        given: dict[str, Any] = change.model_dump(exclude_none=True, exclude={"skip_missed"})
        if change.url is not None:
            given["url"] = checked_url(change.url, http_anywhere=self._settings.http_anywhere)
        if change.enabled is not None:
            given["disabled_reason"] = None if change.enabled else Reason.of(ReasonCode.WEBHOOK_DISABLED, actor=actor)
        return hook.model_copy(update=given)

    def _take(self, stored: StoredWebhook) -> None:
        hook = stored.hook
        feed = DeliveryFeed(self._journal, self._plans)
        self._secrets[hook.id] = stored.secret
        delivery = HookDelivery(stored, self._journal, feed, self._store, self._sender, self._clock, self._settings)
        self._deliveries[hook.id] = delivery
        if hook.enabled and stored.secret is not None:
            task = asyncio.create_task(self._deliver(delivery), name=f"webhook {hook.id}")
            task.add_done_callback(lambda done: _log_defect(hook.id, done))
            self._tasks[hook.id] = task

    async def _deliver(self, delivery: HookDelivery) -> None:
        try:
            await delivery.run()
        except ReceiverGoneError:
            async with self._turn:  # an administrator who sees it disabled may enable it at once
                hook = delivery.hook.model_copy(update={"enabled": False, "disabled_reason": GONE_REASON})
                await self._record(hook, "disabled", "the receiver")
                await self._store.change(hook)
                delivery.change(hook)

    async def _end(self, hook_id: str) -> None:
        task = self._tasks.pop(hook_id, None)
        if task is not None:
            task.cancel()
            await asyncio.wait({task})

    async def _record(self, hook: Webhook, change: HookChange, actor: str) -> None:
        event = self._journal.new_event(
            WebhookChanged(
                webhook_id=hook.id, change=change, host=host_of(hook.url), actor=actor, reason=hook.disabled_reason
            )
        )
        await self._journal.record(event)

    def _delivery(self, hook_id: str) -> HookDelivery:
        if hook_id not in self._deliveries:
            raise NotFoundError(f"no webhook {hook_id!r}", hint="list the webhooks to see their IDs")
        return self._deliveries[hook_id]

    def _view(self, hook_id: str) -> WebhookView:
        delivery = self._deliveries[hook_id]
        behind = max(0, self._journal.last_seq - max(delivery.progress.cursor, first_seq(self._journal) - 1))
        return WebhookView(
            webhook=delivery.hook, state=self._state(delivery), progress=delivery.progress, events_behind=behind
        )

    def _state(self, delivery: HookDelivery) -> HookState:
        if self._secrets[delivery.hook.id] is None:
            return HookState.SECRET_LOST
        if not delivery.hook.enabled:
            return HookState.DISABLED
        task = self._tasks.get(delivery.hook.id)
        if task is None or task.done():
            return HookState.STOPPED
        return HookState.RETRYING if delivery.progress.failures else HookState.DELIVERING


def _word(before: Webhook, after: Webhook) -> HookChange:
    if before.enabled == after.enabled:
        return "changed"
    return "enabled" if after.enabled else "disabled"


def _log_defect(hook_id: str, task: asyncio.Task[None]) -> None:
    if not task.cancelled() and (error := task.exception()) is not None:
        log.error(
            "the task of a webhook failed; it continues after a change or a restart", webhook=hook_id, exc_info=error
        )
