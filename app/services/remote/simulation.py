"""Simulated vehicles, where there are none: they are controlled at their own gateway."""

from __future__ import annotations

from typing import NoReturn

from app.domain.errors import SimulatorNotRunningError
from app.domain.ports.simulated_vehicles import FAULT_KINDS, Fault
from app.services.remote.fleet import RemoteFleet
from app.services.simulation import FaultSet, SimulatorView, SpeedView


class RemoteSimulation:
    """SimulationApi of an API node."""

    def __init__(self, fleet: RemoteFleet) -> None:
        self._fleet = fleet

    async def view(self) -> SimulatorView:
        return SimulatorView(
            configured=False,
            available=False,
            reason=self._why(),
            vehicles=[],
            faults=list(FAULT_KINDS),
            speed=None,
        )

    async def set_fault(self, fault: Fault, actor: str) -> FaultSet:
        self._refuse()

    async def set_speed(self, speed: float, actor: str) -> SpeedView:
        self._refuse()

    def _refuse(self) -> NoReturn:
        raise SimulatorNotRunningError(self._why(), gateway_urls=list(self._fleet.urls()))

    def _why(self) -> str:
        return "simulated vehicles are controlled at their own gateway" + "".join(
            f", {url}" for url in self._fleet.urls()
        )
