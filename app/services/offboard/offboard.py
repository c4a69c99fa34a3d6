"""Offboard control of the whole fleet: one control for each vehicle that was ever asked for."""

from __future__ import annotations

import asyncio

from app.services.clock import Clock
from app.services.fleet import Fleet
from app.services.offboard.control import OffboardControl
from app.services.offboard.settings import OffboardSettings
from app.services.runs import Runs


class Offboard:
    """The registry."""

    def __init__(self, fleet: Fleet, runs: Runs, clock: Clock, settings: OffboardSettings | None = None) -> None:
        self._fleet = fleet
        self._runs = runs
        self._clock = clock
        self.settings = settings or OffboardSettings()
        self._vehicles: dict[str, OffboardControl] = {}

    def vehicle(self, vehicle_id: str) -> OffboardControl:
        """One vehicle. Raises NotFoundError."""
        vehicle = self._fleet.vehicle(vehicle_id)
        if vehicle_id not in self._vehicles:
            control = OffboardControl(vehicle, self._fleet, self._runs, self._clock, self.settings)
            self._vehicles[vehicle_id] = control
        return self._vehicles[vehicle_id]

    async def close(self) -> None:
        """Hold what is flown by hand, and stop. Idempotent."""
        vehicles, self._vehicles = tuple(self._vehicles.values()), {}
        await asyncio.gather(*(one.close() for one in vehicles))
