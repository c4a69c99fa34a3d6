"""Commands that a person gives a vehicle outside a run: hold, return, land."""

from __future__ import annotations

import contextlib
from collections.abc import Awaitable, Callable
from typing import Final, Literal

from app.domain.errors import ConflictError, StorageError, WaydropError
from app.domain.events.vehicle import VehicleCommand
from app.domain.ports import VehicleLink
from app.domain.reason import Reason, because_of_error
from app.services.fleet import Fleet
from app.services.hold_here import hold_here
from app.services.journal import Journal

_ACTIONS: Final[dict[str, Callable[[VehicleLink], Awaitable[None]]]] = {
    "hold": hold_here,
    "return": lambda link: link.return_to_launch(),
    "land": lambda link: link.land(),
}
_OF_A_RUN: Final = {"hold": "pause", "return": "return", "land": "land"}
"""What the same is called of a run that flies."""


class VehicleCommands:
    """Refuses while a run owns the vehicle. Disarmed it only holds: so it leaves a mode in which it does not arm."""

    def __init__(self, fleet: Fleet, journal: Journal) -> None:
        self._fleet = fleet
        self._journal = journal

    async def hold(self, vehicle_id: str, by: str) -> None:
        """Hold mode; a wing in Hold circles where it is now. Raises ConflictError, LinkError."""
        await self._do("hold", vehicle_id, by)

    async def return_to_launch(self, vehicle_id: str, by: str) -> None:
        """Return mode. Raises ConflictError, LinkError."""
        await self._do("return", vehicle_id, by)

    async def land(self, vehicle_id: str, by: str) -> None:
        """Land mode. Raises ConflictError, LinkError."""
        await self._do("land", vehicle_id, by)

    async def _do(self, action: str, vehicle_id: str, by: str) -> None:
        link = self._fleet.link(vehicle_id)
        run_id = self._fleet.vehicle(vehicle_id).run_id
        if run_id is not None:
            raise ConflictError(
                f"run {run_id} has vehicle {vehicle_id}",
                hint=f"use POST /api/v1/runs/{run_id}/{_OF_A_RUN[action]} in flight; before, abort the run first",
            )
        if not link.state().armed and action != "hold":
            raise ConflictError(
                f"vehicle {vehicle_id} is not armed: it cannot {action}", hint="disarmed it can only hold"
            )
        with contextlib.suppress(StorageError):  # logged by the journal; bringing a vehicle home waits for no disk
            await self._record(vehicle_id, action, by, "sent")
        self._fleet.vehicle(vehicle_id).commanded(action)
        try:
            await _ACTIONS[action](link)
        except WaydropError as error:
            self._fleet.vehicle(vehicle_id).commanded("")
            with contextlib.suppress(StorageError):
                await self._record(vehicle_id, action, by, "failed", because_of_error(error.code, error.detail))
            raise
        await self._record(vehicle_id, action, by, "done")

    async def _record(
        self,
        vehicle_id: str,
        action: str,
        by: str,
        outcome: Literal["sent", "done", "failed"],
        reason: Reason | None = None,
    ) -> None:
        told = VehicleCommand(command=action, by=by, outcome=outcome, reason=reason)
        await self._journal.record(self._journal.new_event(told, vehicle_id=vehicle_id))
