"""/webhooks. Administrators only: URLs may contain secrets, and the service sends requests to them."""

from __future__ import annotations

from typing import Final

from aiohttp import web
from pydantic import BaseModel

from app.api.bodies import Empty, json_answer, json_body
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route, tagged
from app.api.services import WEBHOOKS
from app.services.access import Role
from app.services.webhooks.views import WebhookRequest, WebhookTestView, WebhookUpdate, WebhookView

_ONE: Final = f"{API}/webhooks/{{webhook_id}}"


class WebhooksView(BaseModel):
    """All webhooks, oldest first."""

    webhooks: list[WebhookView]


class NewWebhookView(WebhookView):
    """A new webhook with its secret, which is returned only once."""

    secret: str


async def create_webhook(call: Call[NoQuery, WebhookRequest]) -> web.Response:
    view, secret = await call.request.app[WEBHOOKS].create(call.body, actor=call.principal.name)
    made = NewWebhookView(**dict(view), secret=secret)
    return json_answer(made, status=201, headers={"Location": f"{API}/webhooks/{view.webhook.id}"})


async def list_webhooks(call: Call[NoQuery, Empty]) -> web.Response:
    return json_answer(WebhooksView(webhooks=list(await call.request.app[WEBHOOKS].list_webhooks())))


async def get_webhook(call: Call[NoQuery, Empty]) -> web.Response:
    return json_answer(await call.request.app[WEBHOOKS].get(call.path_value("webhook_id")))


async def update_webhook(call: Call[NoQuery, WebhookUpdate]) -> web.Response:
    hooks = call.request.app[WEBHOOKS]
    return json_answer(await hooks.change(call.path_value("webhook_id"), call.body, actor=call.principal.name))


async def delete_webhook(call: Call[NoQuery, Empty]) -> web.Response:
    await call.request.app[WEBHOOKS].delete(call.path_value("webhook_id"), actor=call.principal.name)
    return web.Response(status=204)


async def test_webhook(call: Call[NoQuery, Empty]) -> web.Response:
    return json_answer(await call.request.app[WEBHOOKS].test(call.path_value("webhook_id")))


ROUTES: tuple[AnyRoute, ...] = tagged(
    "webhooks",
    Route(
        method="POST",
        path=f"{API}/webhooks",
        handler=create_webhook,
        summary="Create a webhook that sends signed delivery notifications",
        role=Role.ADMIN,
        body=json_body(WebhookRequest),
        answers=(Answer(201, "The webhook, including its secret", NewWebhookView, headers=("Location",)),),
        errors=("state.conflict", "input.invalid", "storage.failed"),
        # no Idempotency-Key: the stored response would contain the secret
    ),
    Route(
        method="GET",
        path=f"{API}/webhooks",
        handler=list_webhooks,
        summary="List webhooks with their delivery status",
        role=Role.ADMIN,
        answers=(Answer(200, "The webhooks", WebhooksView),),
    ),
    Route(
        method="GET",
        path=_ONE,
        handler=get_webhook,
        summary="Get a webhook with its delivery status",
        role=Role.ADMIN,
        answers=(Answer(200, "The webhook", WebhookView),),
        errors=("resource.not_found",),
    ),
    Route(
        method="PATCH",
        path=_ONE,
        handler=update_webhook,
        summary="Update, enable or disable a webhook, or skip messages that were not delivered",
        role=Role.ADMIN,
        body=json_body(WebhookUpdate),
        answers=(Answer(200, "The updated webhook", WebhookView),),
        errors=("resource.not_found", "input.invalid", "storage.failed"),
    ),
    Route(
        method="DELETE",
        path=_ONE,
        handler=delete_webhook,
        summary="Delete a webhook",
        role=Role.ADMIN,
        answers=(Answer(204, "The webhook was deleted"),),
        errors=("resource.not_found", "storage.failed"),
    ),
    Route(
        method="POST",
        path=f"{_ONE}/test",
        handler=test_webhook,
        summary="Send a test message now and return the result",
        role=Role.ADMIN,
        answers=(Answer(200, "The result", WebhookTestView),),
        errors=("resource.not_found", "webhook.secret_lost"),
    ),
)
