"""/vehicles: known vehicles, and commands to vehicles without a run."""

from __future__ import annotations

from aiohttp import web

from app.api.bodies import Empty, json_answer, json_body
from app.api.models import LinkKeyRequest, VehiclesView
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route, tagged
from app.api.services import COMMANDS, FLEET, LINKS
from app.services.access import Role
from app.services.vehicle_links import LinkKeySetUp
from app.services.views import VehicleView

_COMMAND_ERRORS = (
    "resource.not_found",
    "state.conflict",
    "vehicle.refused",
    "vehicle.link",
    "vehicle.timeout",
)


async def list_vehicles(call: Call[NoQuery, Empty]) -> web.Response:
    return json_answer(VehiclesView(vehicles=list(call.request.app[FLEET].vehicles())))


async def get_vehicle(call: Call[NoQuery, Empty]) -> web.Response:
    return json_answer(call.request.app[FLEET].view(call.path_value("vehicle_id")))


async def hold_vehicle(call: Call[NoQuery, Empty]) -> web.Response:
    commands = call.request.app[COMMANDS]
    return _accepted(await commands.hold(call.path_value("vehicle_id"), actor=call.principal.name))


async def return_vehicle(call: Call[NoQuery, Empty]) -> web.Response:
    commands = call.request.app[COMMANDS]
    return _accepted(await commands.return_to_launch(call.path_value("vehicle_id"), actor=call.principal.name))


async def land_vehicle(call: Call[NoQuery, Empty]) -> web.Response:
    commands = call.request.app[COMMANDS]
    return _accepted(await commands.land(call.path_value("vehicle_id"), actor=call.principal.name))


async def end_quarantine(call: Call[NoQuery, Empty]) -> web.Response:
    fleet, vehicle_id = call.request.app[FLEET], call.path_value("vehicle_id")
    return json_answer(await fleet.end_quarantine(vehicle_id, actor=call.principal.name))


async def set_up_link_key(call: Call[NoQuery, LinkKeyRequest]) -> web.Response:
    links, vehicle_id = call.request.app[LINKS], call.path_value("vehicle_id")
    return json_answer(await links.set_up_signing(vehicle_id, actor=call.principal.name))


def _accepted(view: VehicleView) -> web.Response:
    return json_answer(view, status=202, headers={"Location": f"{API}/vehicles/{view.id}"})


_ACCEPTED = Answer(202, "The vehicle after it entered the mode", VehicleView, headers=("Location",))

ROUTES: tuple[AnyRoute, ...] = tagged(
    "vehicles",
    Route(
        method="POST",
        path=f"{API}/vehicles/{{vehicle_id}}/link-key",
        handler=set_up_link_key,
        summary="Give a vehicle its newest signing key (SETUP_SIGNING), over a link that nobody else hears",
        role=Role.ADMIN,
        body=json_body(LinkKeyRequest),
        answers=(Answer(200, "The vehicle signs with that key", LinkKeySetUp),),
        errors=(
            "resource.not_found",
            "state.conflict",
            "vehicle.quarantined",
            "vehicle.link",
            "vehicle.timeout",
            "storage.failed",
        ),
    ),
    Route(
        method="POST",
        path=f"{API}/vehicles/{{vehicle_id}}/end-quarantine",
        handler=end_quarantine,
        summary="End the quarantine of a vehicle whose system ID no other vehicle uses any more",
        role=Role.ADMIN,
        answers=(Answer(200, "The vehicle, not quarantined", VehicleView),),
        errors=("resource.not_found", "state.conflict"),
    ),
    Route(
        method="GET",
        path=f"{API}/vehicles",
        handler=list_vehicles,
        summary="List vehicles",
        role=Role.VIEWER,
        answers=(Answer(200, "The vehicles", VehiclesView),),
    ),
    Route(
        method="GET",
        path=f"{API}/vehicles/{{vehicle_id}}",
        handler=get_vehicle,
        summary="Get a vehicle",
        role=Role.VIEWER,
        answers=(Answer(200, "The vehicle", VehicleView),),
        errors=("resource.not_found",),
    ),
    *(
        Route(
            method="POST",
            path=f"{API}/vehicles/{{vehicle_id}}/{action}",
            handler=handler,
            summary=summary,
            role=Role.PILOT,
            answers=(_ACCEPTED,),
            errors=(*_COMMAND_ERRORS, "storage.failed"),
        )
        for action, handler, summary in (
            ("hold", hold_vehicle, "Hold position (Hold mode)"),
            ("return", return_vehicle, "Return to launch (Return mode)"),
            ("land", land_vehicle, "Land at the current position (Land mode)"),
        )
    ),
)
