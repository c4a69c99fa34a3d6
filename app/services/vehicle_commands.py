"""Commands of a user to a vehicle outside a run: hold, return, land."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Awaitable, Callable, Mapping
from contextlib import aclosing
from typing import Final, Literal

from app.domain.autopilot.capability import FlightKind, flight_kind
from app.domain.errors import (
    ConflictError,
    LinkError,
    LinkTimeoutError,
    StorageError,
    VehicleInFailsafeError,
    VehicleRefusedError,
    WaydropError,
)
from app.domain.events.vehicle import VehicleAction, VehicleCommand
from app.domain.flight.modes import taken_meanwhile
from app.domain.flight.phase import STOPPED_M_S
from app.domain.offboard.state import who_acts
from app.domain.offboard.tasks.commanded import CIRCLE_HERE
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.reasons import Reason
from app.domain.vehicle.commands import CommandRequest, MavResult, is_late
from app.domain.vehicle.state import FlightMode, VehicleState, VehicleType
from app.services.fleet import Fleet
from app.services.journal import STORED_WITHIN_S, Journal
from app.services.views import VehicleView

ATTEMPTS: Final = 3
FAILSAFE_ACTS_S: Final = 8.0
"""COM_FAIL_ACT_T is 5 s by default, and HEARTBEAT comes once a second."""

STOPS_WITHIN_S: Final = 10.0
"""A rover at 3 m/s stops in Hold mode in two to three seconds."""
FRESH_S: Final = 1.0
LOOK_EVERY_S: Final = 0.05


async def circle_here(link: VehicleLink, send: Callable[[CommandRequest], Awaitable[None]]) -> None:
    """Send it until it is acknowledged, and check before each attempt: it changes the mode, so it would take control.
    Never late: what is seen may be from before the process stood still.

    Raises:
        LinkError: not confirmed, or somebody else acts. VehicleRefusedError, ConflictError: raised by `send`.
    """
    for left in reversed(range(ATTEMPTS)):
        if who_acts(link.state()):
            raise LinkError(
                "not commanded to circle here: a failsafe is active, or somebody else commanded another mode"
            )
        due_s = time.monotonic() + CIRCLE_HERE.timeout_s
        try:
            await send(CIRCLE_HERE)
        except LinkTimeoutError:
            if not left or is_late(due_s, time.monotonic()):
                raise
        else:
            return


def refuse_amid_failsafe(state: VehicleState) -> None:
    """PX4 holds for COM_FAIL_ACT_T (5 s) before a failsafe acts. Any mode that is commanded in that time cancels it: a
    vehicle with an empty battery flew its mission on (flown). Return and Land are ways out, and are not refused, and
    a Hold that lasts longer is all that the failsafe does.

    Raises VehicleInFailsafeError.
    """
    delay_s = state.failsafe_delay_s
    if delay_s is not None and delay_s < FAILSAFE_ACTS_S and state.armed is not False:
        raise VehicleInFailsafeError(
            "not sent: a failsafe holds the vehicle and may be about to act; this command would cancel it",
            hint=f"wait until it acts, at most {FAILSAFE_ACTS_S:g} s; or command return or land",
        )


async def hold_here(link: VehicleLink) -> None:
    """Enter Hold mode, confirmed. A fixed wing in Hold would fly on to its last commanded point: it is commanded to
    circle here.

    Raises:
        VehicleInFailsafeError, VehicleRefusedError, LinkError.
    """
    refuse_amid_failsafe(link.state())
    may_fly_on = _flies_as_wing_in_hold(link, link.state())
    await link.hold()
    if may_fly_on and not link.state().may_be_in_failsafe:
        with contextlib.suppress(ConflictError):  # already being commanded by the end of offboard control
            await circle_here(link, lambda request: _accepted(link, request))


async def land_here(link: VehicleLink, makes_way: Callable[[], bool] = lambda: False) -> None:
    """Enter Land mode, confirmed. A rover that drives stops in Hold first: in Land mode it keeps its speed until it is
    disarmed two seconds later, and rolls on unbraked (flown). A failsafe's hold is no reason to refuse: see
    refuse_amid_failsafe. `makes_way`: whether another command waits; it is not landed then, unless it stands.

    Raises:
        ConflictError: the rover was not seen to stop, or left Hold, or made way; Land was not sent. LinkError.
    """
    if link.identity.vehicle_type is VehicleType.ROVER and not _stands(link.state()):
        await link.hold()
        await _until_it_stands(link, makes_way)
    await link.land()


async def _until_it_stands(link: VehicleLink, makes_way: Callable[[], bool]) -> None:
    until_s = time.monotonic() + STOPS_WITHIN_S
    while not _stands(now := link.state()):
        if makes_way():
            raise ConflictError(
                "not landed: another command came while the rover stopped",
                hint="it was commanded to hold before; see the run for what it does now",
            )
        if now.mode is not FlightMode.HOLD:
            raise taken_meanwhile(now.mode)
        if time.monotonic() > until_s:
            raise ConflictError(
                f"not landed: the rover was not seen to stop within {STOPS_WITHIN_S:g} s; Land mode would switch it "
                "off while it drives",
                hint="it was commanded to hold; land again when it stands",
            )
        await asyncio.sleep(LOOK_EVERY_S)


def _stands(state: VehicleState) -> bool:
    age_s, speed_m_s = state.position_age_s, state.ground_speed_m_s
    is_fresh = state.connected and age_s is not None and age_s <= FRESH_S
    return is_fresh and speed_m_s is not None and speed_m_s < STOPPED_M_S


def _flies_as_wing_in_hold(link: VehicleLink, state: VehicleState) -> bool:
    vehicle_type = link.identity.vehicle_type
    is_wing = vehicle_type is not None and flight_kind(vehicle_type, state.vtol_state) is FlightKind.WING
    return is_wing and state.mode is FlightMode.HOLD and state.armed is not False


async def _accepted(link: VehicleLink, request: CommandRequest) -> None:
    async with aclosing(link.command(request)) as acks:
        async for ack in acks:
            if ack.is_final and ack.result is not MavResult.ACCEPTED:
                raise VehicleRefusedError(
                    f"the vehicle answered {request.command.name} with {ack.word}", result=ack.word
                )


_ACTIONS: Final[Mapping[VehicleAction, Callable[[VehicleLink], Awaitable[None]]]] = {
    "hold": hold_here,
    "return": lambda link: link.return_to_launch(),
    "land": land_here,
}
_OF_A_RUN: Final[Mapping[VehicleAction, str]] = {"hold": "pause", "return": "return", "land": "land"}
"""The action of a run in flight that does the same."""


class VehicleCommands:
    """Refuses while a run owns the vehicle. Disarmed it only holds: so it leaves a mode in which it does not arm."""

    def __init__(self, fleet: Fleet, journal: Journal) -> None:
        self._fleet = fleet
        self._journal = journal

    async def hold(self, vehicle_id: str, actor: str) -> VehicleView:
        """Enter Hold mode; a fixed wing in Hold circles its current position. Raises ConflictError, LinkError."""
        return await self._do("hold", vehicle_id, actor)

    async def return_to_launch(
        self, vehicle_id: str, actor: str, order: Callable[[], Awaitable[None]] | None = None
    ) -> VehicleView:
        """Return mode; `order` is how it is commanded for a run. Raises ConflictError, LinkError."""
        return await self._do("return", vehicle_id, actor, order)

    async def land(self, vehicle_id: str, actor: str) -> VehicleView:
        """Land mode; a rover stops first, see land_here. Raises ConflictError, LinkError."""
        return await self._do("land", vehicle_id, actor)

    async def _do(
        self,
        action: VehicleAction,
        vehicle_id: str,
        actor: str,
        order: Callable[[], Awaitable[None]] | None = None,
    ) -> VehicleView:
        vehicle = self._fleet.vehicle(vehicle_id)
        link, run_id = vehicle.link, vehicle.run_id  # quarantined or not: these three are always sent
        if run_id is not None:
            raise ConflictError(
                f"run {run_id} uses vehicle {vehicle_id}",
                hint=f"{_OF_A_RUN[action]} the run instead, or abort it before takeoff",
            )
        if not link.state().armed and action != "hold":
            raise ConflictError(
                f"vehicle {vehicle_id} is not armed: {action} is not possible", hint="a disarmed vehicle can only hold"
            )
        # the journal logs an error, and stores late what it could not store in time
        with contextlib.suppress(StorageError, TimeoutError):
            async with asyncio.timeout(STORED_WITHIN_S):
                await self._record(vehicle_id, action, actor, "sent")
        vehicle.commanded(action)
        try:
            await (_ACTIONS[action](link) if order is None else order())
        except WaydropError as error:
            vehicle.commanded("")
            with contextlib.suppress(StorageError):
                await self._record(vehicle_id, action, actor, "failed", Reason.of_error(error.code, error.detail))
            raise
        await self._record(vehicle_id, action, actor, "done")
        return vehicle.view()

    async def _record(
        self,
        vehicle_id: str,
        action: VehicleAction,
        actor: str,
        outcome: Literal["sent", "done", "failed"],
        reason: Reason | None = None,
    ) -> None:
        payload = VehicleCommand(command=action, actor=actor, outcome=outcome, reason=reason)
        await self._journal.record(self._journal.new_event(payload, vehicle_id=vehicle_id))
