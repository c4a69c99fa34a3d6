"""Offboard control by one websocket client. Frames are answered in order; when the socket closes, the lease ends."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any, Final

from aiohttp import WSMsgType, web
from pydantic import BaseModel, ValidationError

from app.api.audit import FrameAudit
from app.api.authentication import require_role
from app.api.bodies import read_query
from app.api.observability import Metrics
from app.api.offboard.frames import (
    CLOSE_REASONS,
    AcquireLeaseFrame,
    AnyClientFrame,
    ChangeFrame,
    ClientDocument,
    DoneFrame,
    EnterFrame,
    HandOverLeaseFrame,
    LeaseGrantedFrame,
    LeaveFrame,
    MoveFrame,
    QueuedFrame,
    QueueFrame,
    ReleaseLeaseFrame,
    RemoveFrame,
    RenewLeaseFrame,
    SetpointAckFrame,
    SetpointFrame,
    StateFrame,
    TargetFrame,
    TaskFrame,
    TasksFrame,
    action_of,
)
from app.api.offboard.models import AuditView, ClampView
from app.api.routing import NoQuery
from app.api.settings import ApiSettings
from app.api.tasks import ACTIONS
from app.api.websockets import (
    CloseCode,
    SocketSession,
    WebSocketHandshake,
    out_of_range,
    refused,
    require_handshake,
    unreadable,
)
from app.domain.errors import ConflictError, LeaseLostError, NotFoundError, WaydropError
from app.domain.offboard.state import LeaseChange
from app.domain.reasons import Reason, ReasonCode
from app.services.access import Access, Principal, Role
from app.services.audit import Audit
from app.services.background import end_tasks
from app.services.offboard import Offboard, OffboardControl
from app.services.tasks import TaskQueueService, Tasks

STATE_PERIOD_S: Final = 0.1
TASKS_PERIOD_S: Final = 1.0


class OffboardSession(SocketSession):
    """Reads frames, answers them, and sends notifications."""

    def __init__(
        self,
        socket: web.WebSocketResponse,
        control: OffboardControl,
        queue_service: TaskQueueService,
        principal: Principal,
        audit: FrameAudit,
    ) -> None:
        super().__init__()
        self._socket = socket
        self._audit = audit
        self._queue_service = queue_service
        self._control = control
        self._principal = principal
        self._lease_id: str | None = None
        self._leaving = False
        self._passing: asyncio.Task[None] | None = None
        self._state_changed = asyncio.Event()
        self._state_changed.set()
        self._tasks_changed = asyncio.Event()

    async def run(self) -> CloseCode | None:
        """Serve until either side ends the session. Returns None if the client has gone."""
        unsubscribe = self._control.subscribe(self._on_change)
        tasks = [asyncio.create_task(work) for work in (self._read(), self._send_states(), self._send_tasks())]
        waits: tuple[asyncio.Future[Any], ...] = (*tasks, self.ended)
        try:
            await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
            if self.ended.done():
                await self._send_last_state()
                return self.ended.result()
            for task in tasks:
                if task.done():
                    task.result()
            return None
        finally:
            unsubscribe()
            self._let_go()
            await end_tasks(*tasks, self._passing)

    def _on_change(self) -> None:
        self._state_changed.set()
        self._tasks_changed.set()

    def _let_go(self) -> None:
        """The client closed the socket: command Hold mode at once."""
        if self._lease_id is not None and self._holds():
            self._control.give_up(LeaseChange.RELEASED, Reason.of(ReasonCode.OFFBOARD_SOCKET_CLOSED))

    def _holds(self) -> bool:
        lease = self._control.lease
        return lease is not None and lease.id == self._lease_id

    def _has_lost_it(self) -> bool:
        """Whether a lease of this socket ended without a request of the client."""
        return self._lease_id is not None and not self._leaving and not self._holds()

    # reading --------------------------------------------------------------------------------------------------

    async def _read(self) -> None:
        while True:
            message = await self._socket.receive()
            if message.type is WSMsgType.BINARY:
                return self.end(CloseCode.UNSUPPORTED)
            if message.type is not WSMsgType.TEXT:
                return None
            if self._has_lost_it():
                return self.end(CloseCode.LEASE_ENDED)  # frames sent for a lease that has ended are ignored
            await self._answer(message.data)
            await asyncio.sleep(0)  # buffered frames are read without a pause: yield to other tasks in between

    async def _answer(self, text: str) -> None:
        try:
            frame = ClientDocument.model_validate_json(text).root
        except ValidationError as error:
            await self._send(unreadable(text, ClientDocument, error))
            return
        try:
            answer = self._do(frame)
            if answer is not None:  # entering and leaving end later
                self._accept(frame)
        except WaydropError as error:
            answer = self._refuse(frame, error)
        except ValidationError:  # the values do not fit the MAVLink message: not a reason to end the session
            answer = out_of_range(frame.id)
        if answer is not None:
            await self._send(answer)

    def _do(self, frame: AnyClientFrame) -> BaseModel | None:
        if isinstance(frame, AcquireLeaseFrame):
            return self._take(frame)
        if self._lease_id is None:
            raise LeaseLostError("this socket holds no lease", hint='send {"type": "acquire_lease"} first')
        lease_id, control = self._lease_id, self._control
        match frame:
            case SetpointFrame():
                clamps = control.put(lease_id, frame.setpoint)
                return SetpointAckFrame(id=frame.id, clamped=[ClampView.of(clamp) for clamp in clamps])
            case TaskFrame():
                entry = self._queue_service.insert(lease_id, frame.task, frame.insert, frame.when_empty)
                return QueuedFrame(id=frame.id, task_id=entry.id)
            case QueueFrame() | MoveFrame() | ChangeFrame() | RemoveFrame() | TargetFrame():
                self._edit_queue(lease_id, frame)
            case RenewLeaseFrame():
                control.require(lease_id)
            case HandOverLeaseFrame():
                control.offer(lease_id, frame.to)
            case EnterFrame() | LeaveFrame():
                self._pass(lease_id, frame)
                return None
            case ReleaseLeaseFrame():
                control.release(lease_id, Reason.of(ReasonCode.OFFBOARD_RELEASED))
                self._lease_id = None
        return DoneFrame(id=frame.id, command=frame.type)

    def _edit_queue(
        self, lease_id: str, frame: QueueFrame | MoveFrame | ChangeFrame | RemoveFrame | TargetFrame
    ) -> None:
        match frame:
            case QueueFrame():
                ACTIONS[frame.action](self._queue_service, lease_id)
            case MoveFrame():
                self._queue_service.move(lease_id, frame.task_id, frame.before)
            case ChangeFrame():
                self._queue_service.change(lease_id, frame.task_id, frame.change)
            case RemoveFrame():
                self._queue_service.remove(lease_id, frame.task_id)
            case TargetFrame():
                self._queue_service.retarget(lease_id, frame.task_id, frame.point, frame.motion)

    def _take(self, frame: AcquireLeaseFrame) -> LeaseGrantedFrame:
        if self._lease_id is not None:
            raise ConflictError("this socket already holds the lease")
        if frame.override:
            require_role(self._principal, Role.ADMIN)
        rate_hz = frame.rate_hz or self._control.settings.rate_hz
        lease = self._control.acquire(self._principal.name, rate_hz=rate_hz, override=frame.override)
        self._lease_id = lease.id
        return LeaseGrantedFrame(id=frame.id, holder=lease.holder, expires_in_s=self._control.settings.lease_s)

    def _pass(self, lease_id: str, frame: EnterFrame | LeaveFrame) -> None:
        """Entering and leaving take seconds. Frames are read meanwhile."""
        if self._passing is not None and not self._passing.done():
            raise ConflictError("entering or leaving is in progress")
        work = self._enter(lease_id, frame) if isinstance(frame, EnterFrame) else self._leave(lease_id, frame)
        self._passing = asyncio.create_task(self._run_handover(frame, lambda: work))

    async def _run_handover(self, frame: EnterFrame | LeaveFrame, work: Callable[[], Awaitable[BaseModel]]) -> None:
        try:
            answer = await work()
            self._accept(frame)
        except WaydropError as error:
            answer = self._refuse(frame, error)
        await self._send(answer)

    def _accept(self, frame: AnyClientFrame) -> None:
        if (action := action_of(frame)) is not None:
            self._audit.accept(action)

    def _refuse(self, frame: AnyClientFrame, error: WaydropError) -> BaseModel:
        if (action := action_of(frame)) is not None:
            self._audit.refuse(action, error)
        return refused(frame.id, error)

    async def _enter(self, lease_id: str, frame: EnterFrame) -> BaseModel:
        entries = await self._control.enter(
            lease_id, sticks_held=frame.sticks_held, control_method=frame.control_method
        )
        return DoneFrame(id=frame.id, command="enter", audit=[AuditView.of(entry) for entry in entries])

    async def _leave(self, lease_id: str, frame: LeaveFrame) -> BaseModel:
        self._leaving = True  # the client asked for the end of the lease
        try:
            await self._control.leave(lease_id, frame.to)
            self._lease_id = None
        finally:
            self._leaving = False
        return DoneFrame(id=frame.id, command="leave")

    # sending --------------------------------------------------------------------------------------------------

    async def _send_states(self) -> None:
        """Send the state on every change, conflated while setpoints are sent. A lost lease ends the session."""
        while True:
            self._state_changed.clear()
            if self._has_lost_it():
                return self.end(CloseCode.LEASE_ENDED)
            view = self._control.view()
            await self._send(StateFrame(offboard=view))
            await asyncio.sleep(STATE_PERIOD_S)
            if view.sent is None:
                await self._state_changed.wait()

    async def _send_tasks(self) -> None:
        """Send the queue on every change and once per second, starting with the first task."""
        sent, due_s = 0, math.inf
        while True:
            self._tasks_changed.clear()
            if self._queue_service.changes != sent or time.monotonic() >= due_s:
                sent, due_s = self._queue_service.changes, time.monotonic() + TASKS_PERIOD_S
                await self._send(TasksFrame(queue=self._queue_service.view()))
            with suppress(TimeoutError):
                async with asyncio.timeout(due_s - time.monotonic() if sent else None):
                    await self._tasks_changed.wait()

    async def _send_last_state(self) -> None:
        await self._send(StateFrame(offboard=self._control.view()))

    async def _send(self, frame: BaseModel) -> None:
        if not self._socket.closed:
            await self._socket.send_str(frame.model_dump_json())


MAX_SOCKETS: Final = 64
HEARTBEAT_S: Final = 5.0


class OffboardEndpoint:
    """GET /api/v1/vehicles/{vehicle_id}/offboard as a websocket. Closing the socket ends the lease."""

    def __init__(
        self,
        offboard: Offboard,
        tasks: Tasks,
        access: Access,
        audit: Audit,
        metrics: Metrics,
        settings: ApiSettings,
    ) -> None:
        self._offboard = offboard
        self._audit = audit
        self._tasks = tasks
        self._handshake = WebSocketHandshake(
            "offboard socket", CLOSE_REASONS, access, metrics, settings, max_sockets=MAX_SOCKETS
        )
        self.close = self._handshake.close

    async def fly(self, request: web.Request) -> web.StreamResponse:
        require_handshake(request, hint="open a websocket, or send single setpoints with POST .../offboard/setpoint")
        return await self._handshake.open(
            request,
            lambda socket, principal: self._serve(request, socket, principal),
            role=Role.PILOT,
            heartbeat_s=HEARTBEAT_S,
        )

    async def _serve(
        self, request: web.Request, socket: web.WebSocketResponse, principal: Principal
    ) -> CloseCode | None:
        read_query(request, NoQuery)
        try:
            vehicle = self._offboard.vehicle(request.match_info["vehicle_id"])
            queue_service = self._tasks.vehicle(request.match_info["vehicle_id"])
        except NotFoundError:
            return CloseCode.NO_VEHICLE
        session = OffboardSession(
            socket, vehicle, queue_service, principal, FrameAudit(self._audit, principal, request)
        )
        return await self._handshake.run_session(request, session, session.run)
