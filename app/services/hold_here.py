"""Hold as a person means it: the vehicle stays where it is, also a wing that is in Hold already."""

from __future__ import annotations

import contextlib
from contextlib import aclosing

from app.domain.commands import CommandRequest, MavResult
from app.domain.errors import ConflictError, VehicleRefusedError
from app.domain.ports import VehicleLink
from app.domain.setpoint.capability import FlightKind, flight_kind
from app.domain.vehicle import FlightMode, VehicleState
from app.services.circle_here import circle_here


async def hold_here(link: VehicleLink) -> None:
    """Hold, seen. A wing in Hold would fly on to the place it was last sent to: it is told to circle here.

    Raises:
        VehicleRefusedError, LinkError.
    """
    may_fly_on = _flies_as_wing_in_hold(link, link.state())
    await link.hold()
    if may_fly_on and not link.state().in_failsafe:
        with contextlib.suppress(ConflictError):  # it is being told already, by what has ended its control
            await circle_here(link, lambda request: _accepted(link, request))


def _flies_as_wing_in_hold(link: VehicleLink, state: VehicleState) -> bool:
    vehicle_type = link.identity.vehicle_type
    is_wing = vehicle_type is not None and flight_kind(vehicle_type, state.vtol_state) is FlightKind.WING
    return is_wing and state.mode is FlightMode.HOLD and state.armed is not False


async def _accepted(link: VehicleLink, request: CommandRequest) -> None:
    async with aclosing(link.command(request)) as acks:
        async for ack in acks:
            if ack.is_final and ack.result is not MavResult.ACCEPTED:
                raise VehicleRefusedError(f"{request.command.name} was answered {ack.word}", result=ack.word)
