"""What must be true before a vehicle enters offboard control: its state, its run, its parameters, its fence."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import Final

from app.domain.airspace.geofence import FenceArea, onboard_fence
from app.domain.autopilot import Behaviour, Quantity, autopilot, behaviour_of
from app.domain.autopilot.capability import AuditedParameter, FirmwareProfile, FlightKind, flight_kind
from app.domain.errors import AuditFailedError, OffboardNotReadyError
from app.domain.geo import LocalProjection
from app.domain.mission import MissionType
from app.domain.offboard.control_method import ControlMethod, control_method_if_any
from app.domain.offboard.encode import Follower
from app.domain.offboard.limits import VehiclePose
from app.domain.offboard.messages import Vector
from app.domain.offboard.step import can_stop
from app.domain.offboard.tasks.commanded import Wing
from app.domain.ports.threads import InThread
from app.domain.ports.vehicle_link import VehicleIdentity, VehicleLink
from app.domain.run.run import Run, RunState
from app.domain.vehicle.clock import MAX_LIVE_RATE, is_too_fast
from app.domain.vehicle.state import IN_TRANSITION, FirmwareVersion, VehicleState, VehicleType


@dataclass(frozen=True, slots=True)
class ControlContext:
    """What stays as it is during one lease. `fence` is in the metres of `fence_frame`, around home as it was read.

    `wing`: how it flies to a place by command.
    """

    vehicle_type: VehicleType
    profile: FirmwareProfile
    fresh_s: float
    fence: FenceArea | None = None
    fence_frame: LocalProjection | None = None
    wing: Wing = field(default_factory=Wing)

    @classmethod
    def of(cls, vehicle_type: VehicleType, firmware: FirmwareVersion | None, fresh_s: float) -> ControlContext:
        """Before anything was read."""
        known = behaviour_of(vehicle_type, firmware)
        return cls(vehicle_type, autopilot().setpoint_profile(firmware), fresh_s, wing=Wing.of(None, known))

    def control_method(self, state: VehicleState) -> ControlMethod | None:
        """How its tasks are flown as it flies now; None: not at all."""
        return control_method_if_any(self.kind(state), self.profile)

    def kind(self, state: VehicleState) -> FlightKind:
        """What it flies like now."""
        return flight_kind(self.vehicle_type, state.vtol_state)

    def follower(self, state: VehicleState) -> Follower:
        """What a setpoint is encoded for."""
        home_m = None if state.home is None else state.home.altitude_m
        return Follower(self.kind(state), self.profile, home_m, has_estimate=self.has_estimate(state))

    def has_estimate(self, state: VehicleState) -> bool:
        """Whether a position came lately: PX4 sends none without a valid estimate."""
        return state.position_age_s is not None and state.position_age_s <= self.fresh_s

    def pose(self, state: VehicleState) -> VehiclePose:
        """What a setpoint is limited by."""
        home = state.home
        velocity = (state.velocity_north_m_s or 0.0, state.velocity_east_m_s or 0.0, -(state.velocity_down_m_s or 0.0))
        return VehiclePose(
            kind=self.kind(state),
            home=None if home is None else (home.latitude_deg, home.longitude_deg, home.altitude_m),
            home_ned=state.home_ned_m,
            here=_from_home(state) if self.has_estimate(state) else None,
            velocity=velocity,
            heading_deg=state.heading_deg or 0.0,
            fence=self.fence,
            fence_home=self._home_in_fence(state),
        )

    def _home_in_fence(self, state: VehicleState) -> tuple[float, float]:
        """North and east: somebody may have set another home since the fence was read."""
        if state.home is None or self.fence_frame is None:
            return 0.0, 0.0
        east, north = self.fence_frame.to_local(state.home.latitude_deg, state.home.longitude_deg)
        return north, east


def _from_home(state: VehicleState) -> Vector | None:
    """North, east, up in metres."""
    home = state.home
    if home is None or state.latitude_deg is None or state.longitude_deg is None or state.absolute_altitude_m is None:
        return None
    east, north = LocalProjection(home.latitude_deg, home.longitude_deg).to_local(
        state.latitude_deg, state.longitude_deg
    )
    return north, east, state.absolute_altitude_m - home.altitude_m


@dataclass(frozen=True, slots=True)
class PreflightReport:
    """What would keep offboard control from beginning now. `reason` is empty unless the vehicle's state forbids it.

    `run_id`: the run that must be paused first. `control_method`: how its tasks would be flown; None: not at all.
    """

    reason: str
    hint: str
    audit: Sequence[AuditedParameter]
    control_method: ControlMethod | None = None
    run_id: str | None = None

    @property
    def ready(self) -> bool:
        """Whether it could begin."""
        return not self.reason and not any(entry.blocks for entry in self.audit)


async def preflight_report(
    vehicle_id: str,
    link: VehicleLink,
    context: ControlContext,
    run: Run | None,
    *,
    sticks_held: bool,
    has_setpoint: bool,
) -> PreflightReport:
    """The same checks as an entry makes, and nothing commanded. No parameter is read over a lost link. `has_setpoint`:
    the client, or a task, gives one now.

    Raises:
        LinkError: the parameters cannot be read.
    """
    state = link.state()
    reason, hint = _why_not(vehicle_id, state, context.kind(state), run)
    control_method = context.control_method(state)
    if not reason and control_method is not None and not _can_stream(control_method, context.kind(state), has_setpoint):
        reason, hint = _NOTHING_TO_STREAM
    entries = (
        await _audited(link, control_method or ControlMethod.SETPOINTS, sticks_held=sticks_held)
        if state.connected
        else ()
    )
    in_the_way = None if run is None or run.state is RunState.PAUSED else run.id
    return PreflightReport(reason, hint, entries, control_method, in_the_way)


_NOTHING_TO_STREAM: Final = (
    "there is nothing to stream: a vehicle in fixed-wing flight cannot stop in the air, and its entry begins with a "
    "setpoint or a task",
    "send setpoints that it follows, or queue a task, and enter then",
)


def refuse_unready(vehicle_id: str, state: VehicleState, kind: FlightKind, run: Run | None) -> None:
    """Raises OffboardNotReadyError with the first reason why offboard control may not begin."""
    reason, hint = _why_not(vehicle_id, state, kind, run)
    if reason:
        raise OffboardNotReadyError(reason, hint=hint)


def refuse_nothing_to_stream(control_method: ControlMethod, kind: FlightKind, has_setpoint: bool) -> None:
    """Raises OffboardNotReadyError: after Hold its entry would end with the first setpoint."""
    if not _can_stream(control_method, kind, has_setpoint):
        reason, hint = _NOTHING_TO_STREAM
        raise OffboardNotReadyError(reason, hint=hint)


def _can_stream(control_method: ControlMethod, kind: FlightKind, has_setpoint: bool) -> bool:
    """Without a setpoint a velocity of zero begins the stream."""
    return control_method is ControlMethod.COMMANDS or has_setpoint or can_stop(kind)


def initial_context(vehicle_id: str, who: VehicleIdentity, fresh_s: float) -> ControlContext:
    """Before anything was read. Raises OffboardNotReadyError: its type is not known."""
    if who.vehicle_type is None:
        raise OffboardNotReadyError(f"the type of vehicle {vehicle_id} is not known yet", hint="wait a moment")
    return ControlContext.of(who.vehicle_type, who.firmware, fresh_s)


async def refuse_unsafe_parameters(
    link: VehicleLink, control_method: ControlMethod, *, sticks_held: bool
) -> tuple[AuditedParameter, ...]:
    """The audited parameters, read now. Raises AuditFailedError if one of them forbids it, LinkError."""
    entries = await _audited(link, control_method, sticks_held=sticks_held)
    bad = [entry for entry in entries if entry.blocks]
    if bad:
        raise AuditFailedError(
            "; ".join(f"{entry.parameter}: {entry.meaning}" for entry in bad),
            hint="set the parameter on the vehicle, or set sticks_held if a pilot holds the sticks",
            audit=[asdict(entry) for entry in entries],
        )
    return entries


async def until_no_failsafe(link: VehicleLink, within_s: float) -> None:
    """Return when the vehicle, in Hold by our command, says that no failsafe acts: HEARTBEAT reports it at 1 Hz.

    Raises:
        OffboardNotReadyError: one still acts: a stream could pull the vehicle out of it.
    """
    changed = asyncio.Event()
    end = link.subscribe(lambda _fact: changed.set())
    try:
        async with asyncio.timeout(within_s):
            while link.state().may_be_in_failsafe:
                changed.clear()
                await changed.wait()
    except TimeoutError:
        raise OffboardNotReadyError(
            "a failsafe is still active in Hold mode",
            hint="resolve its cause; a setpoint stream would take the vehicle out of it",
        ) from None
    finally:
        end()


async def with_fence(
    context: ControlContext, link: VehicleLink, entries: Sequence[AuditedParameter], in_thread: InThread
) -> ControlContext:
    """With the fence on board and how wide it circles. Raises as `_read_fence`."""
    known = behaviour_of(context.vehicle_type, link.identity.firmware)
    loiter = known.name_of(Quantity.LOITER_RADIUS_M)
    loiter_m = next((entry.value for entry in entries if entry.parameter == loiter), None)
    fence, frame = await _read_fence(link, known, in_thread)
    return replace(context, fence=fence, fence_frame=frame, wing=Wing.of(loiter_m, known))


async def _read_fence(
    link: VehicleLink, behaviour: Behaviour, in_thread: InThread
) -> tuple[FenceArea | None, LocalProjection | None]:
    """The fence on board and its frame, around home; None without one.

    Raises:
        OffboardNotReadyError: without a home. LinkError.
    """
    items = await link.download(MissionType.FENCE)
    home = link.state().home
    if not items:
        return None, None
    if home is None:
        raise OffboardNotReadyError(
            "the vehicle has a geofence but no home position to measure from", hint="wait for a position fix"
        )
    projection = LocalProjection(home.latitude_deg, home.longitude_deg)
    needs_all = behaviour.needs_all_inclusions
    read = partial(onboard_fence, items, projection, needs_all_inclusions=needs_all)
    return await in_thread(read), projection


async def _audited(
    link: VehicleLink, control_method: ControlMethod, *, sticks_held: bool
) -> tuple[AuditedParameter, ...]:
    known = autopilot(link.identity.autopilot)
    audit = known.audit_commanded if control_method is ControlMethod.COMMANDS else known.audit
    parameters = await link.read_parameters(audit.names)
    if others := audit.to_read_too(parameters):
        parameters = {**parameters, **await link.read_parameters(others)}
    return audit.entries(parameters, sticks_held=sticks_held)


def _why_not(vehicle_id: str, state: VehicleState, kind: FlightKind, run: Run | None) -> tuple[str, str]:
    if not state.connected:
        return f"the link to vehicle {vehicle_id} is lost", "wait until it is connected"
    if not state.armed:
        return f"vehicle {vehicle_id} is not armed", "start a run and pause it in flight, or take off by remote control"
    if kind is FlightKind.AIRSHIP:
        return "PX4 supports no setpoints for airships", ""
    rate = state.clock.least_rate
    if rate is not None and is_too_fast(rate):
        words = f"its clock runs at least {rate:.1f} times faster than Waydrop's"
        return words, f"offboard control is available up to {MAX_LIVE_RATE:g} times real time: slow the simulation down"
    if state.vtol_state in IN_TRANSITION:
        return f"vehicle {vehicle_id} is in a transition", "wait until the transition is complete"
    if run is not None and run.state is not RunState.PAUSED:
        return (
            f"vehicle {vehicle_id} flies run {run.id}, which is {run.state.value}",
            "pause the run first",
        )
    return "", ""
