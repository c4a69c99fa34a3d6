"""/site: what a person decides of a gateway's site in a cluster."""

from __future__ import annotations

from typing import Final

from aiohttp import web
from pydantic import BaseModel

from app.api.bodies import Empty, json_answer
from app.api.routing import Answer, Call, NoQuery, Routes
from app.domain.cluster.lease import LeaseState
from app.domain.errors import NotFoundError
from app.services.access import Role

ROUTES: Final = Routes("site")


class SiteView(BaseModel):
    """What the gateway knows of the lease of its site."""

    site_lease: LeaseState


@ROUTES.route(
    "POST",
    "/site/take-over",
    Role.ADMIN,
    Answer(200, "The gateway has the site", SiteView),
    errors=("resource.not_found", "state.conflict", "gateway.no_reply"),
)
async def take_over(call: Call[NoQuery, Empty]) -> web.Response:
    """Let this gateway take over the vehicles and runs of the other gateway of its site, which is switched off.

    Needed only if this gateway cannot hear on the vehicles' links that the other one is silent. The lease of the other
    gateway must have expired.
    """
    site = call.services.site
    if site is None:
        raise NotFoundError(
            "this is no gateway of a cluster", hint="send the request to the gateway that is to take the site over"
        )
    return json_answer(SiteView(site_lease=(await site.take_over()).state))
