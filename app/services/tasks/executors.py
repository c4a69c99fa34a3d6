"""How a task is flown: by a stream of setpoints or by commands, and the gripper inside it."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import aclosing
from dataclasses import dataclass, replace
from typing import Final, Protocol

from app.domain.autopilot.capability import FlightKind
from app.domain.errors import LeaseLostError, LinkError, SetpointRefusedError, VehicleRefusedError
from app.domain.mission import NAN, MavCmd
from app.domain.offboard.control_method import ControlMethod
from app.domain.offboard.limits import limit
from app.domain.offboard.setpoints import PositionNed
from app.domain.offboard.state import OffboardState
from app.domain.offboard.tasks.commanded import CircleAt, FlyTo, Order, Wing, order, order_request
from app.domain.offboard.tasks.course import EkfOrigin, Ground, Reference, circle_around, refuse_outside
from app.domain.offboard.tasks.forms import GripperAction
from app.domain.offboard.tasks.guidance import (
    CRUISE_M_S,
    Fix,
    SetpointRequest,
    VerticalSpeeds,
    learnt_lag_s,
    stand,
    steer,
)
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.vehicle.commands import CommandRequest, MavResult
from app.domain.vehicle.state import VehicleState
from app.services.offboard.control import OffboardControl


@dataclass(frozen=True, slots=True)
class Seen:
    """Where on its course the vehicle is, and whether it has come to the end."""

    reference: Reference
    arrived: bool


class TaskExecutor(Protocol):
    """Called at every tick. Both raise SetpointRefusedError where the way leads beyond a limit or the fence."""

    @property
    def control_method(self) -> ControlMethod:
        """Which of the two it is."""

    def fly(self, request: SetpointRequest, kind: FlightKind, fix: Fix, seconds: float) -> Seen:
        """On along the course; `seconds` since the last tick."""

    def stand(self, kind: FlightKind, fix: Fix) -> None:
        """Stay here; a wing circles. The place is chosen once."""

    def begin(self) -> None:
        """Reset: something else is flown now, so no holding position is chosen."""


OLDEST_S: Final = 1.0
"""A position older than this is not carried forward: the guidance falls silent, and the dead-man acts."""


def fix_of(state: VehicleState, origin: EkfOrigin) -> Fix | None:
    """The vehicle now: its newest position, carried forward by its velocity. None without a fresh one."""
    latitude, longitude, altitude = state.latitude_deg, state.longitude_deg, state.absolute_altitude_m
    age_s = state.position_age_s
    if latitude is None or longitude is None or altitude is None or age_s is None or age_s > OLDEST_S:
        return None
    velocity = (state.velocity_north_m_s or 0.0, state.velocity_east_m_s or 0.0)
    measured = Fix(origin.place(latitude, longitude), altitude - origin.altitude_m, velocity)
    return measured.ahead(age_s * state.clock.rate)


PARAM2: Final[Mapping[GripperAction, float]] = {"release": 0.0, "grab": 1.0}
"""DO_GRIPPER's param2. Never NaN: PX4 would deny it, and 0 means RELEASE."""
IN_PROGRESS_S: Final = 15.0
STANDS_M_S: Final = 0.5


async def work_gripper(link: VehicleLink, action: GripperAction) -> None:
    """Return when the vehicle has ACCEPTED it. Sent once: whether to try again is the pilot's decision.

    Raises:
        VehicleRefusedError: another final answer; LinkTimeoutError: none, so that it may have acted all the same.
    """
    request = CommandRequest(
        MavCmd.DO_GRIPPER,
        (1.0, PARAM2[action], NAN, NAN, NAN, NAN, NAN),
        attempts=1,
        in_progress_timeout_s=IN_PROGRESS_S,
    )
    async with aclosing(link.command(request)) as acks:
        async for ack in acks:
            final = ack
    if not final.is_final:
        raise LinkError("the gripper command was never finally acknowledged")
    if final.result is not MavResult.ACCEPTED:
        raise VehicleRefusedError(f"the vehicle answered the gripper's {action} with {final.word}", result=final.word)


STOPS_IN_S: Final = 1.0


class ByCommands:
    """A fixed wing in Hold gets DO_REPOSITION and DO_ORBIT, each checked before. `origin`: where their metres begin."""

    control_method: Final = ControlMethod.COMMANDS

    def __init__(self, control: OffboardControl, origin: EkfOrigin) -> None:
        self._control = control
        self._origin = origin
        self._order: Order | None = None
        self._stands = False

    def begin(self) -> None:
        """See TaskExecutor. A rejected command may be requested again."""
        self._stands = False
        self._control.commands.allow_again()

    def stand(self, kind: FlightKind, fix: Fix) -> None:
        """Circle the commanded point: an active command is not checked again, a rejected one is repeated."""
        if not self._stands or self._order is None:
            place = fix.ahead(STOPS_IN_S)
            self._want(FlyTo(place.ground, fix.up_m))
            self._stands = True
        else:
            self._control.commands.ask_again()
            self._repeat(self._order)

    def fly(self, request: SetpointRequest, kind: FlightKind, fix: Fix, seconds: float) -> Seen:
        """The order of this moment. Raises SetpointRefusedError: beyond a limit, or the vehicle refused the last."""
        if self._control.commands.refused:
            raise SetpointRefusedError(self._control.commands.refused, refusal="vehicle.refused")
        before, self._stands = self._order, False
        found = order(request, fix, self._wing, before)
        if found.order == before:
            self._repeat(found.order)
        else:
            self._want(found.order)
        return Seen(found.reference, found.arrived)

    @property
    def _wing(self) -> Wing:
        context = self._control.context
        if context is None:
            raise LeaseLostError("the lease has ended")
        return context.wing

    def _want(self, wanted: Order) -> None:
        self._refuse_beyond(wanted)
        self._order = wanted
        self._repeat(wanted)

    def _repeat(self, wanted: Order) -> None:
        self._control.commands.want(order_request(wanted, self._origin))

    def _refuse_beyond(self, wanted: Order) -> None:
        """The straight line to the point, and the circle around it, where it stays without further commands."""
        control, context = self._control, self._control.context
        if context is None:
            raise LeaseLostError("the lease has ended")
        limits = control.settings.limits.model_copy(update={"when_exceeded": "refuse"})
        where = context.pose(control.link.state())
        if isinstance(wanted, CircleAt):
            center, radius_m = wanted.center, abs(wanted.radius_m)
        else:
            center, radius_m = wanted.ground, context.wing.loiter_m
        place = PositionNed(type="position_ned", north_m=center[0], east_m=center[1], down_m=-wanted.up_m)
        limit(place, limits, where)
        refuse_outside(circle_around(center, radius_m), wanted.up_m, limits, where)


HARMLESS: Final = frozenset({"limit.speed", "limit.climb", "limit.descend"})
"""Clamps that are harmless for a task: it takes longer. Any other clamp changes the course, so the task stops."""
SLOWER: Final = (1.0, 0.5, 0.25, 0.125)


class BySetpoints:
    """The guidance's word of this moment goes where the client's own setpoints go."""

    control_method: Final = ControlMethod.SETPOINTS

    def __init__(self, control: OffboardControl) -> None:
        self._control = control
        self._vertical = VerticalSpeeds.within(control.settings.limits)
        self._stands: tuple[Ground, float] | None = None
        self._lag_s = 0.0

    def begin(self) -> None:
        """See TaskExecutor. Another circle has another lag."""
        self._stands, self._lag_s = None, 0.0

    def stand(self, kind: FlightKind, fix: Fix) -> None:
        """At the chosen position, else where it can stop; if that is rejected, as at a fence, at its current position.

        Raises:
            SetpointRefusedError: rejected there too; the next tick retries.
        """
        chosen, self._stands = self._stands, None
        refused = None
        for place in (chosen, (fix.ahead(STOPS_IN_S).ground, fix.up_m), (fix.ground, fix.up_m)):
            if place is None:
                continue
            try:
                self._control.steer(stand(kind, *place, fix, self._vertical))
            except SetpointRefusedError as error:
                refused = error
            else:
                self._stands = place
                return
        if refused is not None:
            raise refused

    def fly(self, request: SetpointRequest, kind: FlightKind, fix: Fix, seconds: float) -> Seen:
        """As fast as asked, or slower where a velocity would soon lead out of the fence or a limit.

        Raises:
            SetpointRefusedError: it leads there however slow it is, or cannot be slower.
        """
        speed = request.speed_m_s or CRUISE_M_S[kind]
        if kind is FlightKind.ROTARY and self._control.state is OffboardState.ACTIVE:
            self._lag_s = learnt_lag_s(self._lag_s, request.course, fix.ground, fix.velocity, speed, seconds)
        for share in (1.0,) if kind is FlightKind.WING else SLOWER:
            seen = steer(kind, replace(request, speed_m_s=speed * share, vertical=self._vertical), fix, self._lag_s)
            try:
                beyond = [clamp for clamp in self._control.steer(seen.setpoint) if clamp.code not in HARMLESS]
            except SetpointRefusedError as refused:
                error = refused
                continue
            if not beyond:
                return Seen(seen.reference, seen.arrived)
            error = SetpointRefusedError(beyond[0].detail, refusal=beyond[0].code)
        raise error
