"""/simulator: the true state of simulated vehicles, their faults and their speed."""

from __future__ import annotations

from typing import Final

from aiohttp import web

from app.api.bodies import Empty, json_answer
from app.api.routing import STORED, Answer, Call, NoQuery, Routes
from app.domain.ports.simulated_vehicles import FaultRequest, SpeedRequest
from app.services.access import Role
from app.services.simulation import FaultSet, SimulatorView, SpeedView

ROUTES: Final = Routes("simulator")


@ROUTES.route("GET", "/simulator", Role.VIEWER, Answer(200, "The simulator, or that none is running", SimulatorView))
async def get_simulator(call: Call[NoQuery, Empty]) -> web.Response:
    """Get the true state of the simulated vehicles and the faults they support."""
    return json_answer(await call.services.simulation.view())


@ROUTES.route(
    "POST",
    "/simulator/faults",
    Role.PILOT,
    Answer(200, "The fault was set", FaultSet),
    errors=(*STORED, "simulator.not_running", "simulator.refused", "simulator.no_answer"),
)
async def set_simulator_fault(call: Call[NoQuery, FaultRequest]) -> web.Response:
    """Set or clear a fault of a simulated vehicle."""
    return json_answer(await call.services.simulation.set_fault(call.body.root, actor=call.principal.name))


@ROUTES.route(
    "PUT",
    "/simulator/speed",
    Role.PILOT,
    Answer(200, "The speed was changed", SpeedView),
    errors=("simulator.not_running", "simulator.refused", "simulator.no_answer", "storage.failed"),
)
async def set_simulator_speed(call: Call[NoQuery, SpeedRequest]) -> web.Response:
    """Set the simulation speed; also allowed in flight."""
    return json_answer(await call.services.simulation.set_speed(call.body.speed, actor=call.principal.name))
