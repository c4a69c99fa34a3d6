"""What an API node of a cluster answers for what only the vehicle's own gateway does."""

from __future__ import annotations

from aiohttp import web

from app.api.problems import ApiError
from app.api.routing import AnyCall
from app.api.services import GATEWAYS


async def elsewhere(call: AnyCall) -> web.StreamResponse:
    """Offboard control and tasks: their dead-man must not pass through a relay."""
    vehicle_id = call.path_value("vehicle_id")
    url = call.request.app[GATEWAYS].url_of(vehicle_id)
    raise ApiError(
        "gateway.elsewhere",
        f"{vehicle_id} is controlled at its own gateway" + (f": {url}" if url else ""),
        hint="send this request to the gateway",
        gateway_url=url,
    )
