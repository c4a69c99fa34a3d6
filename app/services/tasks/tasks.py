"""The task queues of the whole fleet: one for each vehicle that was ever asked for."""

from __future__ import annotations

from app.services.clock import Clock
from app.services.fleet import Fleet
from app.services.offboard import Offboard
from app.services.tasks.desk import TaskDesk
from app.services.tasks.flight import TaskFlight


class Tasks:
    """The registry."""

    def __init__(self, offboard: Offboard, fleet: Fleet, clock: Clock) -> None:
        self._offboard = offboard
        self._fleet = fleet
        self._clock = clock
        self._desks: dict[str, TaskDesk] = {}

    def vehicle(self, vehicle_id: str) -> TaskDesk:
        """The queue of one vehicle. Raises NotFoundError."""
        control = self._offboard.vehicle(vehicle_id)
        if vehicle_id not in self._desks:
            flight = TaskFlight(control, self._fleet)
            self._desks[vehicle_id] = TaskDesk(flight, self._clock)
        return self._desks[vehicle_id]
