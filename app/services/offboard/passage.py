"""The ways into offboard control and out of it."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, TypeVar

from app.domain.errors import ConflictError, LeaseLostError, OffboardNotReadyError, WaydropError
from app.domain.offboard.state import LeaseChange, OffboardState
from app.domain.run import Run
from app.domain.setpoint.audit import LOITER_RADIUS, AuditEntry
from app.domain.setpoint.means import Means
from app.domain.tasks.commanded import Wing
from app.domain.vehicle import FlightMode
from app.services.offboard.control import OffboardControl
from app.services.offboard.entry import (
    Outlook,
    look_ahead,
    read_fence,
    refuse_unready,
    refuse_unsafe_parameters,
    until_calm,
)
from app.services.offboard.surroundings import Surroundings
from app.services.offboard_view import FlownBy
from app.services.runs import Runs

Destination = Literal["hold", "mission", "return"]
T = TypeVar("T")
_S = OffboardState


class Passage:
    """Enters and leaves one vehicle's offboard control. A lost lease ends either; a new leaving ends the one before."""

    def __init__(self, control: OffboardControl, runs: Runs) -> None:
        self._control = control
        self._runs = runs
        self._entering: asyncio.Task[Sequence[AuditEntry]] | None = None
        self._leaving: asyncio.Task[None] | None = None
        self._leaving_lease_id = ""
        control.subscribe(self._watch)
        control.vehicle.commanded = self._commanded_by_others

    async def look_ahead(self, *, sticks_held: bool) -> Outlook:
        """What `enter` would find now. Needs no lease. Raises OffboardNotReadyError (type unknown), LinkError."""
        vehicle, link = self._control.vehicle, self._control.link
        vehicle_type = link.identity.vehicle_type
        if vehicle_type is None:
            raise OffboardNotReadyError(f"the type of vehicle {vehicle.id} is not known yet", hint="wait a moment")
        surroundings = Surroundings.of(vehicle_type, link.identity.firmware, self._control.settings.fresh_s)
        return await look_ahead(vehicle.id, link, surroundings, await self._run(), sticks_held=sticks_held)

    async def enter(self, lease_id: str, *, sticks_held: bool, by: FlownBy | None = None) -> Sequence[AuditEntry]:
        """Hold, one second of stream, then the mode: a stream alone could pull a vehicle out of a failsafe.

        `by` None: as its tasks are flown. By commands it stays in Hold, and nothing is streamed.

        Raises:
            LeaseLostError, OffboardNotReadyError, AuditFailedError, VehicleRefusedError (with the vehicle's reasons),
            LinkError.
        """
        self._control.require(lease_id)
        if self._control.state is not _S.LEASED:
            raise OffboardNotReadyError(f"offboard control is {self._control.state.value} already")
        self._control.means = self._means(by)
        self._entering = asyncio.create_task(self._enter(sticks_held), name=f"enter {self._control.vehicle.id}")
        return await self._ended(self._entering)

    async def leave(self, lease_id: str, to: Destination) -> None:
        """Leave to a mode, seen, and give the lease back; what is guided stops first.

        Raises:
            LeaseLostError, ConflictError, LinkError.
        """
        control = self._control
        control.require(lease_id)
        if to == "mission" and control.vehicle.run_id is None:
            raise ConflictError("the vehicle flies no run: there is no mission to go back to", hint="leave to hold")
        if control.guide is not None:
            control.guide.left()
        await self._begin_leaving(lease_id, to)

    async def leave_unasked(self, lease_id: str, to: Destination) -> None:
        """As `leave`, for a guide that has ended: it renews nothing. Raises LeaseLostError, LinkError."""
        self._control.check(lease_id)
        await self._begin_leaving(lease_id, to)

    async def _begin_leaving(self, lease_id: str, to: Destination) -> None:
        while self._leaving is not None and not self._leaving.done():
            self._leaving.cancel()
            await asyncio.wait({self._leaving})
        self._leaving_lease_id = lease_id
        self._leaving = asyncio.create_task(self._leave(lease_id, to), name=f"leave {self._control.vehicle.id}")
        try:
            await self._ended(self._leaving)
        except LeaseLostError:
            if self._has_lease(lease_id):
                raise ConflictError(f"leaving to {to} was broken off: another leaving was asked for") from None
            raise

    async def _ended(self, task: asyncio.Task[T]) -> T:
        try:
            await asyncio.wait({task})
        finally:
            task.cancel()
        if task.cancelled():
            raise LeaseLostError(f"the lease ended on the way: {self._control.reason}", hint="take it again")
        return task.result()

    async def _leave(self, lease_id: str, to: Destination) -> None:
        control = self._control
        run = await self._run()
        control.check(lease_id)  # it may have ended meanwhile, and Hold been commanded
        control.say_no_last_word()
        control.move(_S.LEAVING if control.state is _S.ACTIVE else control.state, f"leaving to {to}")
        try:
            await self._command(to, run)
        except BaseException:
            if control.lease is not None and control.state is _S.LEAVING:
                control.move(_S.ACTIVE, f"leaving to {to} failed")
                control.look_again()
            raise
        if self._has_lease(lease_id):
            control.end(LeaseChange.RELEASED, f"left to {to}")

    async def _enter(self, sticks_held: bool) -> Sequence[AuditEntry]:
        control = self._control
        try:
            entries = await self._check(sticks_held)
            control.move(_S.HOLDING, "commanding Hold")
            control.say_no_last_word()
            was_in_hold = control.link.state().mode is FlightMode.HOLD
            await self._hold()
            await until_calm(control.link, control.settings.calm_s)
            if control.means is Means.COMMANDS:
                if was_in_hold:  # by the mode alone it flies on to wherever it was sent last
                    await control.orders.circle_here()
                control.move(_S.ACTIVE, "")
                return entries
            control.move(_S.STREAMING, "the stream flows before the mode is asked for")
            await control.flow.streamed(control.settings.stream_s)
            control.move(_S.SWITCHING, "asking for the mode")
            await control.orders.switch(control.link.enter_offboard())
            if control.lease is not None:
                control.move(_S.ACTIVE, "")
            return entries
        except BaseException as error:
            self._turn_back(error)
            raise

    async def _check(self, sticks_held: bool) -> Sequence[AuditEntry]:
        control, surroundings = self._control, self._control.surroundings
        if surroundings is None:
            raise LeaseLostError("the lease has ended")
        state = control.link.state()
        refuse_unready(control.vehicle.id, state, surroundings.kind(state), await self._run())
        control.move(_S.CHECKING, "reading parameters and the fence")
        entries = await refuse_unsafe_parameters(control.link, control.means, sticks_held=sticks_held)
        loiter_m = next((entry.value for entry in entries if entry.parameter == LOITER_RADIUS), None)
        wing = Wing.of(loiter_m, control.link.identity.firmware)
        control.enclose(replace(surroundings, fence=await read_fence(control.link), wing=wing))
        control.forget_setpoint()  # it was not measured against this fence
        return entries

    def _means(self, by: FlownBy | None) -> Means:
        control = self._control
        surroundings = control.surroundings
        usual = None if surroundings is None else surroundings.means(control.link.state())
        if by == "commands" and usual is not Means.COMMANDS:
            raise OffboardNotReadyError("this vehicle is flown by setpoints", hint="enter without `by`")
        return Means(by) if by else usual or Means.SETPOINTS

    async def _hold(self) -> None:
        run = await self._run()
        await (self._control.link.hold() if run is None else self._runs.pause(run.id, by=self._holder()))

    async def _command(self, to: Destination, run: Run | None) -> None:
        link, by = self._control.link, self._holder()
        if to == "hold" and (run is None or self._control.means is Means.COMMANDS):
            await self._control.hold()
        if run is None:
            if to == "return":
                await link.return_to_launch()
        elif to == "mission":
            await self._runs.resume(run.id, by=by)
        elif to == "return":
            await self._runs.return_to_launch(run.id, by=by)
        else:
            await self._runs.pause(run.id, by=by)

    def _turn_back(self, error: BaseException) -> None:
        """An entry that failed leaves the client its lease and the vehicle in Hold."""
        control = self._control
        if control.lease is None:
            return
        reason = error.detail if isinstance(error, WaydropError) else "the entry was broken off"
        if control.link.state().mode is FlightMode.OFFBOARD:
            control.give_up(LeaseChange.REVOKED, reason)
        else:
            control.move(_S.LEASED, reason)

    def _watch(self) -> None:
        if self._control.lease is None and self._entering is not None:
            self._entering.cancel()
        if self._leaving is None or self._has_lease(self._leaving_lease_id):
            return
        if self._leaving is not asyncio.current_task():  # one that has succeeded ends its lease itself
            self._leaving.cancel()

    def _commanded_by_others(self, action: str) -> None:
        """A commanded wing is in Hold, so that the mode tells nothing of Hold; on the way in and out it is ours."""
        control = self._control
        control.commanded = action
        if action == "":
            return  # it was refused: nothing was commanded after all
        if action != "hold":
            control.say_no_last_word()
        elif control.means is Means.COMMANDS and control.state is _S.ACTIVE:
            control.give_up(LeaseChange.REVOKED, "Hold was commanded")

    def _has_lease(self, lease_id: str) -> bool:
        return self._control.lease is not None and self._control.lease.id == lease_id

    def _holder(self) -> str:
        return "" if self._control.lease is None else self._control.lease.holder

    async def _run(self) -> Run | None:
        run_id = self._control.vehicle.run_id
        return None if run_id is None else await self._runs.get(run_id)
