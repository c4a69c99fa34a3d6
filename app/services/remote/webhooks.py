"""Webhooks of a cluster: the node that writes the store delivers them, the others ask it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from app.services.remote.calls import Caller
from app.services.webhooks import Webhooks
from app.services.webhooks.views import WebhookRequest, WebhookTestView, WebhookUpdate, WebhookView

LEADER: Final = "leader"
"""In place of a site, in calls to the node that delivers."""
LEADER_CALLS: Final = "waydrop.leader"


class WebhookCalls:
    """What nodes ask of the one that delivers: each public method is a call."""

    def __init__(self, webhooks: Webhooks) -> None:
        self._webhooks = webhooks

    async def create_webhook(self, order: WebhookRequest, actor: str) -> tuple[WebhookView, str]:
        return await self._webhooks.create(order, actor=actor)

    async def list_webhooks(self) -> Sequence[WebhookView]:
        return await self._webhooks.list_webhooks()

    async def webhook(self, hook_id: str) -> WebhookView:
        return await self._webhooks.get(hook_id)

    async def change_webhook(self, hook_id: str, change: WebhookUpdate, actor: str) -> WebhookView:
        return await self._webhooks.change(hook_id, change, actor=actor)

    async def delete_webhook(self, hook_id: str, actor: str) -> None:
        await self._webhooks.delete(hook_id, actor=actor)

    async def test_webhook(self, hook_id: str) -> WebhookTestView:
        return await self._webhooks.test(hook_id)


class RemoteWebhooks:
    """WebhooksApi of an API node."""

    def __init__(self, caller: Caller) -> None:
        self._caller = caller

    async def create(self, request: WebhookRequest, *, actor: str) -> tuple[WebhookView, str]:
        made: tuple[WebhookView, str] = await self._call(
            "create_webhook", tuple[WebhookView, str], order=request, actor=actor
        )
        return made

    async def list_webhooks(self) -> Sequence[WebhookView]:
        found: Sequence[WebhookView] = await self._call("list_webhooks", list[WebhookView])
        return found

    async def get(self, hook_id: str) -> WebhookView:
        view: WebhookView = await self._call("webhook", WebhookView, hook_id=hook_id)
        return view

    async def change(self, hook_id: str, change: WebhookUpdate, *, actor: str) -> WebhookView:
        view: WebhookView = await self._call(
            "change_webhook", WebhookView, hook_id=hook_id, change=change.model_dump(exclude_unset=True), actor=actor
        )
        return view

    async def delete(self, hook_id: str, *, actor: str) -> None:
        await self._call("delete_webhook", type(None), hook_id=hook_id, actor=actor)

    async def test(self, hook_id: str) -> WebhookTestView:
        view: WebhookTestView = await self._call("test_webhook", WebhookTestView, hook_id=hook_id)
        return view

    async def _call(self, method: str, returns: Any, **arguments: object) -> Any:
        return await self._caller.call(LEADER_CALLS, LEADER, method, returns, **arguments)
