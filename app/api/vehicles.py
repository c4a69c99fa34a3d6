"""/vehicles: known vehicles, and commands to vehicles without a run."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Final

from aiohttp import web

from app.api.bodies import Empty, json_answer
from app.api.models import LinkKeyRequest, VehiclesView
from app.api.routing import API, STORED, Answer, Call, NoQuery, Routes
from app.services.access import Role
from app.services.vehicle_links import LinkKeySetUp
from app.services.views import VehicleView

ROUTES: Final = Routes("vehicles")

_COMMAND_ERRORS = (*STORED, "state.conflict", "vehicle.refused", "vehicle.link", "vehicle.timeout")
_ACCEPTED = Answer(202, "The vehicle after it entered the mode", VehicleView, headers=("Location",))


@ROUTES.route(
    "GET", "/vehicles", Role.VIEWER, Answer(200, "Those that have connected since the service started", VehiclesView)
)
async def list_vehicles(call: Call[NoQuery, Empty]) -> web.Response:
    """List vehicles."""
    return json_answer(VehiclesView(vehicles=list(call.services.fleet.vehicles())))


@ROUTES.route(
    "GET",
    "/vehicles/{vehicle_id}",
    Role.VIEWER,
    Answer(200, "The vehicle", VehicleView),
    errors=("resource.not_found",),
)
async def get_vehicle(call: Call[NoQuery, Empty]) -> web.Response:
    """Get a vehicle."""
    return json_answer(call.services.fleet.view(call.path_value("vehicle_id")))


@ROUTES.route(
    "POST",
    "/vehicles/{vehicle_id}/hold",
    Role.PILOT,
    _ACCEPTED,
    errors=(*_COMMAND_ERRORS, "vehicle.in_failsafe"),
    is_urgent=True,
)
async def hold_vehicle(call: Call[NoQuery, Empty]) -> web.Response:
    """Hold position (Hold mode)."""
    return await _command(call, call.services.commands.hold)


@ROUTES.route("POST", "/vehicles/{vehicle_id}/return", Role.PILOT, _ACCEPTED, errors=_COMMAND_ERRORS, is_urgent=True)
async def return_vehicle(call: Call[NoQuery, Empty]) -> web.Response:
    """Return to launch (Return mode)."""
    return await _command(call, call.services.commands.return_to_launch)


@ROUTES.route("POST", "/vehicles/{vehicle_id}/land", Role.PILOT, _ACCEPTED, errors=_COMMAND_ERRORS, is_urgent=True)
async def land_vehicle(call: Call[NoQuery, Empty]) -> web.Response:
    """Land at the current position (Land mode)."""
    return await _command(call, call.services.commands.land)


@ROUTES.route(
    "POST",
    "/vehicles/{vehicle_id}/end-quarantine",
    Role.ADMIN,
    Answer(200, "The vehicle, not quarantined", VehicleView),
    errors=("resource.not_found", "state.conflict"),
)
async def end_quarantine(call: Call[NoQuery, Empty]) -> web.Response:
    """End the quarantine of a vehicle whose system ID no other vehicle uses any more."""
    fleet, vehicle_id = call.services.fleet, call.path_value("vehicle_id")
    return json_answer(await fleet.end_quarantine(vehicle_id, actor=call.principal.name))


@ROUTES.route(
    "POST",
    "/vehicles/{vehicle_id}/link-key",
    Role.ADMIN,
    Answer(200, "The vehicle signs with that key", LinkKeySetUp),
    errors=(*STORED, "state.conflict", "vehicle.quarantined", "vehicle.link", "vehicle.timeout"),
)
async def set_up_link_key(call: Call[NoQuery, LinkKeyRequest]) -> web.Response:
    """Give a vehicle its newest signing key (SETUP_SIGNING), over a link that nobody else hears."""
    links, vehicle_id = call.services.links, call.path_value("vehicle_id")
    return json_answer(await links.set_up_signing(vehicle_id, actor=call.principal.name))


async def _command(call: Call[NoQuery, Empty], action: Callable[[str, str], Awaitable[VehicleView]]) -> web.Response:
    view = await action(call.path_value("vehicle_id"), call.principal.name)
    return json_answer(view, status=202, headers={"Location": f"{API}/vehicles/{view.id}"})
