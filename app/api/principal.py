"""/principal: who is authenticated, and which roles it has. The page shows only what the role allows."""

from __future__ import annotations

from typing import Final

from aiohttp import web

from app.api.bodies import Empty, json_answer
from app.api.routing import Answer, Call, NoQuery, Routes
from app.domain.model import Frozen
from app.services.access import Role

ROUTES: Final = Routes("access")


class PrincipalView(Frozen):
    """The name of the token (`local` if no token is required) and its role.

    `roles` lists the roles that it includes: viewer, dispatcher, pilot, admin.
    """

    name: str
    role: Role
    roles: list[Role]


@ROUTES.route("GET", "/principal", Role.VIEWER, Answer(200, "The name and role of the token", PrincipalView))
async def get_principal(call: Call[NoQuery, Empty]) -> web.Response:
    """Get the authenticated principal and its roles."""
    role = call.principal.role
    roles = [other for other in Role if role.allows(other)]
    return json_answer(PrincipalView(name=call.principal.name, role=role, roles=roles))
