"""/webhooks. Administrators only: URLs may contain secrets, and the service sends requests to them."""

from __future__ import annotations

from typing import Final

from aiohttp import web
from pydantic import BaseModel

from app.api.bodies import Empty, json_answer
from app.api.routing import API, STORED, Answer, Call, NoQuery, Routes
from app.services.access import Role
from app.services.webhooks.views import WebhookRequest, WebhookTestView, WebhookUpdate, WebhookView

ROUTES: Final = Routes("webhooks")


class WebhooksView(BaseModel):
    """All webhooks, oldest first."""

    webhooks: list[WebhookView]


class NewWebhookView(WebhookView):
    """A new webhook with its secret, which is returned only once."""

    secret: str


@ROUTES.route(
    "POST",
    "/webhooks",
    Role.ADMIN,
    Answer(201, "The webhook, including its secret", NewWebhookView, headers=("Location",)),
    errors=("state.conflict", "input.invalid", "events.pruned", "storage.failed"),
    unkeyed="the stored response would contain the secret",
)
async def create_webhook(call: Call[NoQuery, WebhookRequest]) -> web.Response:
    """Create a webhook that sends signed delivery notifications."""
    view, secret = await call.services.webhooks.create(call.body, actor=call.principal.name)
    made = NewWebhookView(**dict(view), secret=secret)
    return json_answer(made, status=201, headers={"Location": f"{API}/webhooks/{view.webhook.id}"})


@ROUTES.route("GET", "/webhooks", Role.ADMIN, Answer(200, "The webhooks", WebhooksView))
async def list_webhooks(call: Call[NoQuery, Empty]) -> web.Response:
    """List webhooks with their delivery status."""
    return json_answer(WebhooksView(webhooks=list(await call.services.webhooks.list_webhooks())))


@ROUTES.route(
    "GET", "/webhooks/{webhook_id}", Role.ADMIN, Answer(200, "The webhook", WebhookView), errors=("resource.not_found",)
)
async def get_webhook(call: Call[NoQuery, Empty]) -> web.Response:
    """Get a webhook with its delivery status."""
    return json_answer(await call.services.webhooks.get(call.path_value("webhook_id")))


@ROUTES.route(
    "PATCH",
    "/webhooks/{webhook_id}",
    Role.ADMIN,
    Answer(200, "The updated webhook", WebhookView),
    errors=(*STORED, "input.invalid"),
)
async def update_webhook(call: Call[NoQuery, WebhookUpdate]) -> web.Response:
    """Update, enable or disable a webhook, or skip messages that were not delivered."""
    hooks = call.services.webhooks
    return json_answer(await hooks.change(call.path_value("webhook_id"), call.body, actor=call.principal.name))


@ROUTES.route("DELETE", "/webhooks/{webhook_id}", Role.ADMIN, Answer(204, "The webhook was deleted"), errors=STORED)
async def delete_webhook(call: Call[NoQuery, Empty]) -> web.Response:
    """Delete a webhook."""
    await call.services.webhooks.delete(call.path_value("webhook_id"), actor=call.principal.name)
    return web.Response(status=204)


@ROUTES.route(
    "POST",
    "/webhooks/{webhook_id}/test",
    Role.ADMIN,
    Answer(200, "The result", WebhookTestView),
    errors=("resource.not_found", "webhook.secret_lost"),
)
async def test_webhook(call: Call[NoQuery, Empty]) -> web.Response:
    """Send a test message now and return the result."""
    return json_answer(await call.services.webhooks.test(call.path_value("webhook_id")))
