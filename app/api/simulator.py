"""/simulator: the true state of simulated vehicles, their faults and their speed."""

from __future__ import annotations

from aiohttp import web

from app.api.bodies import Empty, json_answer, json_body
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route, tagged
from app.api.services import SIMULATION
from app.domain.ports.simulated_vehicles import FaultRequest, SpeedRequest
from app.services.access import Role
from app.services.simulation import FaultSet, SimulatorView, SpeedView


async def get_simulator(call: Call[NoQuery, Empty]) -> web.Response:
    return json_answer(await call.request.app[SIMULATION].view())


async def set_simulator_fault(call: Call[NoQuery, FaultRequest]) -> web.Response:
    return json_answer(await call.request.app[SIMULATION].set_fault(call.body.root, actor=call.principal.name))


async def set_simulator_speed(call: Call[NoQuery, SpeedRequest]) -> web.Response:
    return json_answer(await call.request.app[SIMULATION].set_speed(call.body.speed, actor=call.principal.name))


ROUTES: tuple[AnyRoute, ...] = tagged(
    "simulator",
    Route(
        method="GET",
        path=f"{API}/simulator",
        handler=get_simulator,
        summary="Get the true state of the simulated vehicles and the faults they support",
        role=Role.VIEWER,
        answers=(Answer(200, "The simulator, or that none is running", SimulatorView),),
    ),
    Route(
        method="POST",
        path=f"{API}/simulator/faults",
        handler=set_simulator_fault,
        summary="Set or clear a fault of a simulated vehicle",
        role=Role.PILOT,
        body=json_body(FaultRequest),
        answers=(Answer(200, "The fault was set", FaultSet),),
        errors=(
            "resource.not_found",
            "simulator.not_running",
            "simulator.refused",
            "simulator.no_answer",
            "storage.failed",
        ),
    ),
    Route(
        method="PUT",
        path=f"{API}/simulator/speed",
        handler=set_simulator_speed,
        summary="Set the simulation speed; also allowed in flight",
        role=Role.PILOT,
        body=json_body(SpeedRequest),
        answers=(Answer(200, "The speed was changed", SpeedView),),
        errors=("simulator.not_running", "simulator.refused", "simulator.no_answer", "storage.failed"),
    ),
)
