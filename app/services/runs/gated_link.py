"""A vehicle's link for one run: it sends what flies the mission only while this gateway may command."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable
from contextlib import aclosing
from typing import Any, cast

from app.domain.errors import VehicleTakenError
from app.domain.mission import Mission
from app.domain.offboard.tasks.commanded import CIRCLE_HERE
from app.domain.ports.vehicle_link import UploadProgress, VehicleLink
from app.domain.vehicle.commands import CommandAck, CommandRequest


class GatedLink:
    """A VehicleLink. Asked right before each command, and in each step of a transfer: between two of them the process
    may have stood still, and another gateway has the vehicle. Hold, return, land and disarm are always sent.
    """

    def __init__(self, link: VehicleLink, may_command: Callable[[], bool]) -> None:
        self._link = link
        self._may_command = may_command

    @classmethod
    def of(cls, link: VehicleLink, may_command: Callable[[], bool]) -> VehicleLink:
        return cast(VehicleLink, cls(link, may_command))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._link, name)

    async def arm(self, leaves: Callable[[], None] = lambda: None) -> None:
        self._require_command()
        await self._link.arm(leaves)

    async def start_mission(self) -> None:
        self._require_command()
        await self._link.start_mission()

    async def set_current(self, seq: int) -> None:
        self._require_command()
        await self._link.set_current(seq)

    async def upload(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        self._require_command()
        async with aclosing(self._link.upload(mission)) as steps:
            async for step in steps:
                self._require_command()
                yield step

    async def replace_mission(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        self._require_command()
        async with aclosing(self._link.replace_mission(mission)) as steps:
            async for step in steps:
                self._require_command()
                yield step

    async def command(self, request: CommandRequest) -> AsyncGenerator[CommandAck, None]:
        if request != CIRCLE_HERE:  # it belongs to Hold: a wing in Hold flies on to its last point
            self._require_command()
        async with aclosing(self._link.command(request)) as acks:
            async for ack in acks:
                yield ack

    def _require_command(self) -> None:
        if not self._may_command():
            raise VehicleTakenError(
                "another gateway may command this vehicle: nothing is sent",
                hint="see `site_lease` in /healthz; hold, return and land are always sent",
            )
