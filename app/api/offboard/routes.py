"""/vehicles/{id}/offboard: lease, entry, exit and single setpoints. Streams use the websocket at the same path."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any, Final, Literal, TypeVar

from aiohttp import web
from pydantic import BaseModel

from app.api.authentication import require_role
from app.api.bodies import Empty, json_answer, json_body
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
from app.api.routing import OFFBOARD_PATH, Answer, AnyRoute, Call, NoQuery, Route, tagged
from app.api.services import FLEET, OFFBOARD
from app.domain.autopilot import autopilot
from app.domain.autopilot.capability import flight_kind
from app.domain.offboard.control_method import capabilities
from app.domain.reasons import Reason, ReasonCode
from app.services.access import Role
from app.services.offboard import OffboardControl
from app.services.views import OffboardView

# Routes that command a vehicle: the JSON body contains the request and the lease that authorizes it.


ModelT = TypeVar("ModelT", bound=BaseModel)


def pilot_route(
    path: str,
    handler: Callable[[Call[NoQuery, ModelT]], Awaitable[web.StreamResponse]],
    body: type[ModelT],
    summary: str,
    *,
    answer: Answer,
    errors: tuple[str, ...],
    method: Literal["POST", "PATCH", "DELETE"] = "POST",
    idempotent: bool = False,
    is_audited: bool = True,
) -> Route[NoQuery, ModelT]:
    """Return the route of one action, for pilots and administrators."""
    return Route(
        method=method,
        path=path,
        handler=handler,
        summary=summary,
        role=Role.PILOT,
        body=json_body(body),
        answers=(answer,),
        errors=errors,
        idempotent=idempotent,
        is_audited=is_audited,
    )


_PATH: Final = OFFBOARD_PATH
_LEASE: Final = ("resource.not_found", "offboard.lease_lost")
_LINK: Final = ("vehicle.quarantined", "vehicle.refused", "vehicle.link", "vehicle.timeout", "storage.failed")


def _control(call: Call[Any, Any]) -> OffboardControl:
    return call.request.app[OFFBOARD].vehicle(call.path_value("vehicle_id"))


async def get_offboard(call: Call[NoQuery, Empty]) -> web.Response:
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


async def acquire_offboard_lease(call: Call[NoQuery, LeaseRequest]) -> web.Response:
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


async def renew_offboard_lease(call: Call[NoQuery, LeaseUse]) -> web.Response:
    control = _control(call)
    control.require(call.body.lease)
    return json_answer(control.view())


async def hand_over_offboard_lease(call: Call[NoQuery, HandOverRequest]) -> web.Response:
    control = _control(call)
    control.offer(call.body.lease, call.body.to)
    return json_answer(control.view())


async def release_offboard_lease(call: Call[NoQuery, LeaseUse]) -> web.Response:
    control = _control(call)
    control.release(call.body.lease, Reason.of(ReasonCode.OFFBOARD_RELEASED))
    return json_answer(control.view())


async def check_offboard_entry(call: Call[EntryCheckQuery, Empty]) -> web.Response:
    call.request.app[FLEET].require_usable(call.path_value("vehicle_id"))  # a quarantined vehicle cannot be checked
    outlook = await _control(call).look_ahead(sticks_held=call.query.sticks_held)
    return json_answer(EntryCheckView.of(outlook))


async def enter_offboard(call: Call[NoQuery, EntryRequest]) -> web.Response:
    control = _control(call)
    entries = await control.enter(
        call.body.lease, sticks_held=call.body.sticks_held, control_method=call.body.control_method
    )
    return json_answer(EntryView(audit=[AuditView.of(entry) for entry in entries], offboard=control.view()))


async def leave_offboard(call: Call[NoQuery, LeaveRequest]) -> web.Response:
    control = _control(call)
    await control.leave(call.body.lease, call.body.to)
    return json_answer(control.view())


async def send_setpoint(call: Call[NoQuery, SetpointRequest]) -> web.Response:
    clamps = _control(call).put(call.body.lease, call.body.setpoint)
    return json_answer(SetpointAck(clamped=[ClampView.of(clamp) for clamp in clamps]))


_VIEW: Final = Answer(200, "The state of offboard control", OffboardView)

ROUTES: tuple[AnyRoute, ...] = tagged(
    "offboard",
    Route(
        method="GET",
        path=_PATH,
        handler=get_offboard,
        summary="Get the state of offboard control: lease holder, accepted setpoints, task support and limits",
        role=Role.VIEWER,
        answers=(Answer(200, "The state of offboard control", OffboardDetail),),
        errors=("resource.not_found",),
    ),
    pilot_route(
        f"{_PATH}/lease",
        acquire_offboard_lease,
        LeaseRequest,
        "Acquire the lease",
        answer=Answer(201, "The lease", LeaseGrant, headers=("Location",)),
        errors=("resource.not_found", "vehicle.quarantined", "offboard.lease_held", "offboard.not_ready"),
    ),
    pilot_route(
        f"{_PATH}/lease/renew",
        renew_offboard_lease,
        LeaseUse,
        "Renew the lease",
        answer=_VIEW,
        errors=_LEASE,
        is_audited=False,
    ),
    pilot_route(
        f"{_PATH}/lease/hand-over",
        hand_over_offboard_lease,
        HandOverRequest,
        "Offer the lease to another client",
        answer=_VIEW,
        errors=_LEASE,
    ),
    pilot_route(
        f"{_PATH}/lease/release",
        release_offboard_lease,
        LeaseUse,
        "Release the lease; a vehicle under offboard control is commanded to hold",
        answer=_VIEW,
        errors=_LEASE,
    ),
    Route(
        method="GET",
        path=f"{_PATH}/entry-check",
        handler=check_offboard_entry,
        summary="Check whether the vehicle can enter offboard control; sends no command",
        role=Role.PILOT,
        query=EntryCheckQuery,
        answers=(Answer(200, "The result of the check", EntryCheckView),),
        errors=(
            "resource.not_found",
            "vehicle.quarantined",
            "offboard.not_ready",
            "vehicle.refused",
            "vehicle.link",
            "vehicle.timeout",
        ),
    ),
    pilot_route(
        f"{_PATH}/enter",
        enter_offboard,
        EntryRequest,
        "Enter offboard control: Hold mode, one second of setpoints, then OFFBOARD mode",
        answer=Answer(200, "The vehicle is in OFFBOARD mode", EntryView),
        errors=(*_LEASE, "offboard.not_ready", "offboard.audit_failed", "run.wrong_state", *_LINK),
    ),
    pilot_route(
        f"{_PATH}/leave",
        leave_offboard,
        LeaveRequest,
        "Leave offboard control to Hold, the paused mission or Return, and release the lease",
        answer=_VIEW,
        errors=(*_LEASE, "state.conflict", "run.wrong_state", *_LINK),
    ),
    pilot_route(
        f"{_PATH}/setpoint",
        send_setpoint,
        SetpointRequest,
        "Send one setpoint",
        answer=Answer(200, "It is sent from the next tick on, for at most 0.4 s", SetpointAck),
        errors=(*_LEASE, "setpoint.refused"),
        is_audited=False,
    ),
)
