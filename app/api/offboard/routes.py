"""/vehicles/{id}/offboard: lease, entry, exit and single setpoints. Streams use the websocket at the same path."""

from __future__ import annotations

from typing import Any, Final

from aiohttp import web

from app.api.authentication import require_role
from app.api.bodies import Empty, json_answer
from app.api.offboard.models import (
    AuditView,
    CapabilityView,
    ClampView,
    EntryCheckQuery,
    EntryCheckView,
    EntryRequest,
    EntryView,
    HandOverRequest,
    LeaseGrant,
    LeaseRequest,
    LeaseUse,
    LeaveRequest,
    OffboardDetail,
    SetpointAck,
    SetpointRequest,
    TaskControlView,
)
from app.api.routing import NEW_WORK, VEHICLE, Answer, Call, NoQuery, Routes
from app.api.services import OFFBOARD
from app.domain.autopilot import autopilot
from app.domain.autopilot.capability import flight_kind
from app.domain.offboard.control_method import capabilities
from app.domain.reasons import Reason, ReasonCode
from app.services.access import Role
from app.services.offboard import OffboardControl
from app.services.views import OffboardView

ROUTES: Final = Routes("offboard")

_VIEW: Final = Answer(200, "The state of offboard control", OffboardView)
_LEASE: Final = ("resource.not_found", "offboard.lease_lost")
_LINK: Final = (*VEHICLE, "storage.failed")
_RUN: Final = ("run.wrong_state", "run.not_followed")


def _control(call: Call[Any, Any]) -> OffboardControl:
    return call.request.app[OFFBOARD].vehicle(call.path_value("vehicle_id"))


@ROUTES.route(
    "GET",
    "/vehicles/{vehicle_id}/offboard",
    Role.VIEWER,
    Answer(200, "The state of offboard control", OffboardDetail),
    errors=("resource.not_found",),
)
async def get_offboard(call: Call[NoQuery, Empty]) -> web.Response:
    """Get the state of offboard control: lease holder, accepted setpoints, task support and limits."""
    control = _control(call)
    who = control.link.identity
    known, tasks = (
        [],
        TaskControlView(
            control_method=None, reason="the type of the vehicle is not known yet", hint="retry in a few seconds"
        ),
    )
    if who.vehicle_type is not None:
        kind = flight_kind(who.vehicle_type, control.link.state().vtol_state)
        profile = autopilot(who.autopilot).setpoint_profile(who.firmware)
        known = [CapabilityView.of(row) for row in capabilities(kind, profile)]
        tasks = TaskControlView.of(kind, profile)
    limits = control.settings.limits
    return json_answer(OffboardDetail(offboard=control.view(), capabilities=known, tasks=tasks, limits=limits))


@ROUTES.route(
    "POST",
    "/vehicles/{vehicle_id}/offboard/lease",
    Role.PILOT,
    Answer(201, "The lease", LeaseGrant, headers=("Location",)),
    errors=(*NEW_WORK, "resource.not_found", "vehicle.quarantined", "offboard.lease_held", "offboard.not_ready"),
    unkeyed="the stored response would contain the ID of the lease, its holder's secret",
)
async def acquire_offboard_lease(call: Call[NoQuery, LeaseRequest]) -> web.Response:
    """Acquire the lease."""
    if call.body.override:
        require_role(call.principal, Role.ADMIN)
    control = _control(call)
    rate_hz = call.body.rate_hz or control.settings.rate_hz
    lease = control.acquire(call.principal.name, rate_hz=rate_hz, override=call.body.override)
    return json_answer(
        LeaseGrant(
            lease=lease.id,
            vehicle_id=lease.vehicle_id,
            holder=lease.holder,
            expires_in_s=control.settings.lease_s,
        ),
        status=201,
        headers={"Location": call.request.path.removesuffix("/lease")},
    )


@ROUTES.route("POST", "/vehicles/{vehicle_id}/offboard/lease/renew", Role.PILOT, _VIEW, errors=_LEASE, is_audited=False)
async def renew_offboard_lease(call: Call[NoQuery, LeaseUse]) -> web.Response:
    """Renew the lease."""
    control = _control(call)
    control.require(call.body.lease)
    return json_answer(control.view())


@ROUTES.route("POST", "/vehicles/{vehicle_id}/offboard/lease/hand-over", Role.PILOT, _VIEW, errors=_LEASE)
async def hand_over_offboard_lease(call: Call[NoQuery, HandOverRequest]) -> web.Response:
    """Offer the lease to another client."""
    control = _control(call)
    control.offer(call.body.lease, call.body.to)
    return json_answer(control.view())


@ROUTES.route("POST", "/vehicles/{vehicle_id}/offboard/lease/release", Role.PILOT, _VIEW, errors=_LEASE, is_urgent=True)
async def release_offboard_lease(call: Call[NoQuery, LeaseUse]) -> web.Response:
    """Release the lease; a vehicle under offboard control is commanded to hold."""
    control = _control(call)
    control.release(call.body.lease, Reason.of(ReasonCode.OFFBOARD_RELEASED))
    return json_answer(control.view())


@ROUTES.route(
    "GET",
    "/vehicles/{vehicle_id}/offboard/entry-check",
    Role.PILOT,
    Answer(200, "The result of the check", EntryCheckView),
    errors=(*VEHICLE, "resource.not_found", "offboard.not_ready"),
)
async def check_offboard_entry(call: Call[EntryCheckQuery, Empty]) -> web.Response:
    """Check whether the vehicle can enter offboard control; sends no command."""
    call.services.fleet.require_usable(call.path_value("vehicle_id"))  # a quarantined vehicle cannot be checked
    report = await _control(call).preflight(sticks_held=call.query.sticks_held)
    return json_answer(EntryCheckView.of(report))


@ROUTES.route(
    "POST",
    "/vehicles/{vehicle_id}/offboard/enter",
    Role.PILOT,
    Answer(200, "The vehicle is in OFFBOARD mode", EntryView),
    errors=(
        *(*_LEASE, *NEW_WORK, *_RUN, *_LINK),
        *("offboard.not_ready", "offboard.audit_failed", "vehicle.in_failsafe"),
    ),
)
async def enter_offboard(call: Call[NoQuery, EntryRequest]) -> web.Response:
    """Enter offboard control: Hold mode, one second of setpoints, then OFFBOARD mode."""
    control = _control(call)
    entries = await control.enter(
        call.body.lease, sticks_held=call.body.sticks_held, control_method=call.body.control_method
    )
    return json_answer(EntryView(audit=[AuditView.of(entry) for entry in entries], offboard=control.view()))


@ROUTES.route(
    "POST",
    "/vehicles/{vehicle_id}/offboard/leave",
    Role.PILOT,
    _VIEW,
    errors=(*_LEASE, "state.conflict", "vehicle.in_failsafe", *_RUN, *_LINK),
    is_urgent=True,
)
async def leave_offboard(call: Call[NoQuery, LeaveRequest]) -> web.Response:
    """Leave offboard control to Hold, the paused mission or Return, and release the lease."""
    control = _control(call)
    await control.leave(call.body.lease, call.body.to)
    return json_answer(control.view())


@ROUTES.route(
    "POST",
    "/vehicles/{vehicle_id}/offboard/setpoint",
    Role.PILOT,
    Answer(200, "It is sent from the next tick on, for at most 0.4 s", SetpointAck),
    errors=(*_LEASE, "setpoint.refused"),
    is_audited=False,
)
async def send_setpoint(call: Call[NoQuery, SetpointRequest]) -> web.Response:
    """Send one setpoint."""
    clamps = _control(call).put(call.body.lease, call.body.setpoint)
    return json_answer(SetpointAck(clamped=[ClampView.of(clamp) for clamp in clamps]))
