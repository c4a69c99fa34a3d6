"""Webhooks of a cluster: the node that writes the store delivers them, the others ask it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from app.services.remote.calls import Caller, CallFunctions
from app.services.webhooks import Webhooks
from app.services.webhooks.views import WebhookRequest, WebhookTestView, WebhookUpdate, WebhookView

LEADER: Final = "leader"
"""In place of a site, in calls to the node that delivers."""
LEADER_CALLS: Final = "waydrop.leader"


def webhook_calls(webhooks: Webhooks) -> CallFunctions:
    """What nodes ask of the one that delivers."""
    return {
        "create_webhook": webhooks.create,
        "list_webhooks": webhooks.list_webhooks,
        "webhook": webhooks.get,
        "change_webhook": webhooks.change,
        "delete_webhook": webhooks.delete,
        "test_webhook": webhooks.test,
    }


class RemoteWebhooks:
    """WebhooksApi of an API node."""

    def __init__(self, caller: Caller) -> None:
        self._caller = caller

    async def create(self, request: WebhookRequest, *, actor: str) -> tuple[WebhookView, str]:
        made: tuple[WebhookView, str] = await self._call(
            "create_webhook", tuple[WebhookView, str], request=request, actor=actor
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
