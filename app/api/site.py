"""/sites of a cluster, and /site: what a person decides of a gateway's own one."""

from __future__ import annotations

from typing import Final

from aiohttp import web
from pydantic import BaseModel

from app.api.bodies import Empty, json_answer
from app.api.routing import Answer, Call, NoQuery, Routes
from app.domain.cluster.lease import LeaseState
from app.domain.errors import NotFoundError
from app.services.access import Role
from app.services.views import SiteStatus

ROUTES: Final = Routes("site")


class SiteTakeoverView(BaseModel):
    """The lease of the gateway's site, and the runs of the other gateway that could not be taken over yet.

    This gateway tries to take them over until it has them.
    """

    site_lease: LeaseState
    left_run_ids: list[str]


class SitesView(BaseModel):
    """The sites of a cluster, by name."""

    sites: list[SiteStatus]


@ROUTES.route("GET", "/sites", Role.VIEWER, Answer(200, "The sites", SitesView))
async def list_sites(call: Call[NoQuery, Empty]) -> web.Response:
    """List the sites of the cluster whose gateways this API node has heard since its start.

    Empty without an API node: a gateway serves only its own site.
    """
    gateways = call.services.gateways
    return json_answer(SitesView(sites=[] if gateways is None else list(gateways.site_statuses())))


@ROUTES.route(
    "POST",
    "/site/take-over",
    Role.ADMIN,
    Answer(200, "The gateway has the site", SiteTakeoverView),
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
    taken = await site.take_over()
    return json_answer(SiteTakeoverView(site_lease=taken.claim.state, left_run_ids=list(taken.left_run_ids)))
