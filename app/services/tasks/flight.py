"""Flies the task queue of one vehicle through its offboard control, for as long as the lease is renewed."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping
from enum import StrEnum
from typing import Final

from app.domain.autopilot.capability import FlightKind
from app.domain.errors import CommandExpiredError, SetpointRefusedError, VehicleRefusedError, WaydropError
from app.domain.events.vehicle import GripperOutcome, TaskChange, TasksChanged, TasksGripper
from app.domain.offboard.control_method import ControlMethod
from app.domain.offboard.state import OffboardState
from app.domain.offboard.tasks.course import Course, EkfOrigin, PointCourse, Reference
from app.domain.offboard.tasks.forms import Goto, GripperAction, InsertMode, Task, WhenEmpty
from app.domain.offboard.tasks.guidance import Fix, SetpointRequest
from app.domain.offboard.tasks.queue import QueuedTask, TaskQueue
from app.domain.reasons import Reason, ReasonCode
from app.services.fleet import Fleet
from app.services.journal import STORED_WITHIN_S
from app.services.offboard.control import Destination, OffboardControl
from app.services.runs import Runs
from app.services.tasks.executors import STANDS_M_S, ByCommands, BySetpoints, TaskExecutor, fix_of, work_gripper
from app.services.views import TaskReport, TaskState


class Phase(StrEnum):
    """The phase of the queue."""

    IDLE = "idle"
    FLYING = "flying"
    PAUSED = "paused"
    MANUAL = "manual"
    ENDING = "ending"


WORDS: Final[Mapping[Phase, TaskState]] = {
    Phase.IDLE: "idle",
    Phase.PAUSED: "paused",
    Phase.MANUAL: "manual",
    Phase.ENDING: "ending",
}
"""A queue that is flown has several words more: see the report."""


STEERED: Final = (OffboardState.STREAMING, OffboardState.SWITCHING, OffboardState.ACTIVE)
STALE_TARGET_S: Final = 5.0
"""A moving target without a report for this time counts as stopped."""


class TaskFlight:
    """The `SetpointSource` of offboard control. All of it runs on the event loop.

    The queue belongs to one lease, `lease_id`: what is left of it is dropped when that lease ends, however it ends.
    """

    def __init__(self, control: OffboardControl, fleet: Fleet, runs: Runs) -> None:
        self.control = control
        self.queue = TaskQueue()
        self.phase = Phase.IDLE
        self.reason: Reason | None = None
        self.when_empty: WhenEmpty = "plan"
        self.lease_id: str | None = None
        self.origin: EkfOrigin | None = None
        self.seen: Reference | None = None
        self.changes = 0
        self._fleet = fleet
        self._runs = runs
        self._executor: TaskExecutor | None = None
        self._ticked_s: float | None = None
        self._leaving: asyncio.Task[None] | None = None
        self._gripping: asyncio.Task[None] | None = None
        control.set_setpoint_source(self)
        control.subscribe(self._check_lease)

    # what the queue service does -------------------------------------------------------------------------------

    def take_over(self, lease_id: str) -> None:
        """The queue belongs to this lease."""
        self.lease_id = lease_id

    def set_origin(self, origin: EkfOrigin) -> None:
        """From where the tasks' local coordinates count."""
        self.origin = origin

    def move_target(self, task_id: str, task: Task, course: Course) -> None:
        """The target of a goto is elsewhere: the task keeps its place and its time."""
        self.queue = self.queue.moved(task_id, task, course)

    def put(
        self,
        queue: TaskQueue,
        change: TaskChange,
        entry: QueuedTask | None,
        mode: InsertMode | None = None,
        when_empty: WhenEmpty | None = None,
    ) -> None:
        """Another queue in the place of this one. If its current task is another, that one begins."""
        self.when_empty = when_empty or self.when_empty
        was = None if self.queue.current is None else self.queue.current.id
        self.queue = queue
        if was != (None if queue.current is None else queue.current.id):
            self._begin()
        if self.phase is Phase.IDLE and queue.entries:
            self.phase = Phase.FLYING
        self.record(change, entry, mode=mode)
        self._end_if_empty()

    def finish(self, change: TaskChange) -> None:
        """The current task has ended."""
        self.put(self.queue.next(), change, self.queue.current)

    def stop(self, change: TaskChange, reason: Reason) -> None:
        """Hold position; a fixed wing circles. The current task keeps its elapsed time."""
        self.phase, self.reason = Phase.PAUSED, reason
        self._steer_anew()
        self.record(change, self.queue.current, reason)

    def go_on(self) -> None:
        """The guidance has the vehicle again."""
        self.phase, self.reason = Phase.FLYING, None
        self._steer_anew()
        self.record("resumed", self.queue.current)
        self._end_if_empty()

    def record(
        self,
        change: TaskChange,
        entry: QueuedTask | None,
        reason: Reason | None = None,
        *,
        mode: InsertMode | None = None,
    ) -> None:
        """Record the change, and notify the listeners of offboard control."""
        self.changes += 1
        lease = self.control.lease
        payload = TasksChanged(
            change=change,
            task_id=None if entry is None else entry.id,
            task=None if entry is None else entry.task,
            holder=None if lease is None else lease.holder,
            insert_mode=mode,
            reason=reason,
            task_list=self.queue.task_list,
        )
        self._fleet.record(self.control.vehicle, payload)
        self.control.changed()

    @property
    def is_gripping(self) -> bool:
        """Whether a gripper command is pending."""
        return self._gripping is not None

    # what offboard control asks of its setpoint source ---------------------------------------------------------

    def report(self) -> TaskReport | None:
        if self.changes == 0:
            return None
        current = self.queue.current
        return TaskReport(
            state=self._word(),
            remaining_s=round(self.queue.remaining_s, 1),
            task_list=list(self.queue.task_list),
            current_id=None if current is None else current.id,
            reason=self.reason,
        )

    def refuse_client_setpoint(self) -> None:
        """See SetpointSource: the mode that ends control may have been commanded already, so it is not held back."""
        if self.phase is Phase.ENDING:
            raise SetpointRefusedError(
                "no tasks were left: the vehicle is leaving offboard control",
                refusal="setpoint.leaving",
                hint="leave to hold stops it; to fly it, acquire the lease again",
            )

    def client_sent_setpoint(self) -> None:
        """See SetpointSource: a setpoint of the client's own takes the vehicle away from the guidance."""
        if self.phase in (Phase.FLYING, Phase.PAUSED):
            self.phase, self.reason = Phase.MANUAL, Reason.of(ReasonCode.TASK_CLIENT_FLIES)
            self.record("manual", self.queue.current, self.reason)

    def client_leaves(self) -> None:
        if self.phase in (Phase.FLYING, Phase.ENDING):
            self.stop("paused", Reason.of(ReasonCode.TASK_LEAVING))

    def tick(self, now_s: float) -> SetpointRefusedError | None:
        seconds, self._ticked_s = now_s - (now_s if self._ticked_s is None else self._ticked_s), now_s
        control = self.control
        if self.phase not in (Phase.FLYING, Phase.PAUSED) or control.state not in STEERED:
            return None
        if control.context is None or self.origin is None:
            return None
        state = control.link.state()
        fix = fix_of(state, self.origin)
        if fix is None:  # the dead-man acts, and tells this
            no_fix = SetpointRefusedError("no recent position of the vehicle", refusal="setpoint.no_estimate")
            return self._silent(no_fix)
        if self.phase is Phase.FLYING and control.state is OffboardState.ACTIVE:
            self.queue = self.queue.flown(seconds)
            if self.queue.is_over_time:
                self.finish("time_over")
        if self.phase not in (Phase.FLYING, Phase.PAUSED):
            return None
        return self._steer(control.context.kind(state), fix, now_s, seconds * state.clock.rate)

    def _silent(self, error: SetpointRefusedError) -> SetpointRefusedError:
        self.control.commands.note(error)
        return error

    def _word(self) -> TaskState:
        if self.phase is not Phase.FLYING:
            return WORDS[self.phase]
        if self.control.state is not OffboardState.ACTIVE:
            return "waiting"
        return "flying" if self.queue.entries else "standing"

    # flying ---------------------------------------------------------------------------------------------------

    def _steer(self, kind: FlightKind, fix: Fix, now_s: float, seconds: float) -> SetpointRefusedError | None:
        entry, executor = self.queue.current, self._current_executor()
        try:
            if self.phase is Phase.PAUSED or entry is None:
                executor.stand(kind, fix)
            else:
                self._fly(executor, entry, kind, fix, now_s, seconds)
        except SetpointRefusedError as error:
            if self.phase is Phase.FLYING and entry is not None:
                self.stop("blocked", Reason.of_error(error.code, error.detail))
            return self._silent(error)
        return None

    def _current_executor(self) -> TaskExecutor:
        if self._executor is None or self._executor.control_method is not self.control.control_method:
            if self.control.control_method is ControlMethod.COMMANDS and self.origin is not None:
                self._executor = ByCommands(self.control, self.origin)
            else:
                self._executor = BySetpoints(self.control)
        return self._executor

    def _steer_anew(self) -> None:
        if self._executor is not None:
            self._executor.begin()

    def _fly(
        self, executor: TaskExecutor, entry: QueuedTask, kind: FlightKind, fix: Fix, now_s: float, seconds: float
    ) -> None:
        up_m = fix.up_m if entry.up_m is None else entry.up_m
        seen = executor.fly(_setpoint_request(entry, up_m, now_s), kind, fix, seconds)
        self.queue, self.seen = self.queue.begun(up_m, seen.reference.leg), seen.reference
        if seen.arrived and self.control.state is OffboardState.ACTIVE:
            self._arrive(entry, fix)

    def _arrive(self, entry: QueuedTask, fix: Fix) -> None:
        task = entry.task
        if not isinstance(task, Goto):
            self.finish("reached")
        elif task.gripper is not None:
            if self._gripping is None and max(map(abs, fix.velocity)) <= STANDS_M_S:
                self._gripping = asyncio.create_task(self._grip(entry.id, task.gripper))
        elif not task.stay and task.motion is None:
            self.finish("reached")

    async def _grip(self, task_id: str, action: GripperAction) -> None:
        """The gripper, once; its answer ends the task or stops the queue. Without a record nothing is sent."""
        is_sent = False
        try:
            await self._store_gripper(task_id, action)
            is_sent = True
            await work_gripper(self.control.link, action)
        except asyncio.CancelledError:
            ended = Reason.of(ReasonCode.TASK_ENDED_BEFORE_ANSWER)
            self._record_gripper(task_id, action, "unknown" if is_sent else "failed", ended)
            raise
        except WaydropError as error:
            is_answered = not is_sent or isinstance(error, VehicleRefusedError)
            outcome: GripperOutcome = "failed" if is_answered else "unknown"
            self._record_gripper(task_id, action, outcome, Reason.of_error(error.code, error.detail))
            self._gripping = None
            if self.phase is Phase.FLYING:
                self.stop("blocked", Reason.of_error(error.code, error.detail))
        else:
            self._record_gripper(task_id, action, "done")
            self._gripping = None
            self.finish("gripper_done")

    def _end_if_empty(self) -> None:
        """Control goes back to the plan, or the vehicle stands and waits; before it was entered, nothing happens."""
        if self.queue.entries or self.phase is not Phase.FLYING:
            return
        if self.control.state is not OffboardState.ACTIVE:
            self.phase = Phase.IDLE
        elif self.when_empty == "plan":
            self.phase, self.reason = Phase.ENDING, Reason.of(ReasonCode.TASK_NONE_LEFT)
            leaving = self._leave(self.lease_id or "")
            self._leaving = asyncio.create_task(leaving, name=f"tasks end {self.control.vehicle.id}")

    async def _leave(self, lease_id: str) -> None:
        """Resume the paused run; without one the vehicle holds."""
        to: Destination = "hold" if self.control.vehicle.run_id is None else "mission"
        try:
            await self.control.leave_without_renewal(lease_id, to)
        except WaydropError as error:
            if self.phase is Phase.ENDING:
                self.stop(
                    "blocked", Reason.of(ReasonCode.TASK_LEAVING_FAILED, to=to, error=error.code, detail=error.detail)
                )

    def _begin(self) -> None:
        """Another task is current: nothing of the one before counts."""
        self.seen = None
        self._steer_anew()
        if self._gripping is not None:
            self._gripping.cancel()
            self._gripping = None

    def _check_lease(self) -> None:
        lease = self.control.lease
        if self.lease_id is None:
            self.reason = None if lease is not None else self.reason  # what ended an earlier lease explains nothing now
            return
        if lease is not None and lease.id == self.lease_id:
            return
        self.lease_id, self.origin, self.phase, self._ticked_s = None, None, Phase.IDLE, None
        why, self.when_empty = self.control.reason, "plan"
        self.reason = None if lease is not None else why
        dropped, self.queue = self.queue, self.queue.cleared()
        self._begin()
        self._executor = None
        if dropped.entries:
            self.record("dropped", dropped.current, why)

    async def _store_gripper(self, task_id: str, action: GripperAction) -> None:
        """With the vehicle's run: none of its drops tells from now on what the gripper shows as its own.

        Raises:
            StorageError, RunNotFollowedError. CommandExpiredError: the vehicle may be elsewhere by now, or not ours.
        """
        began_s, vehicle = time.monotonic(), self.control.vehicle
        sent = TasksGripper(task_id=task_id, action=action, outcome="sent")
        await self._fleet.store(vehicle, sent)
        self._refuse_late_gripper(began_s)
        if vehicle.run_id is not None:
            await self._runs.use_gripper(vehicle.run_id)
        self._refuse_late_gripper(began_s)

    def _refuse_late_gripper(self, began_s: float) -> None:
        if time.monotonic() - began_s > STORED_WITHIN_S:
            raise CommandExpiredError("the command was not sent: its record was stored too late")
        if self.phase is not Phase.FLYING or self.control.state is not OffboardState.ACTIVE:
            raise CommandExpiredError("the command was not sent: the task no longer had the vehicle")

    def _record_gripper(
        self,
        task_id: str,
        action: GripperAction,
        outcome: GripperOutcome,
        reason: Reason | None = None,
    ) -> None:
        payload = TasksGripper(task_id=task_id, action=action, outcome=outcome, reason=reason)
        self._fleet.record(self.control.vehicle, payload)


def _setpoint_request(entry: QueuedTask, up_m: float, now_s: float) -> SetpointRequest:
    task, course = entry.task, entry.course
    if isinstance(course, PointCourse):
        course = course.at(now_s, STALE_TARGET_S)
    stays = isinstance(task, Goto) and (task.stay or task.motion is not None)
    yaw_deg = task.yaw_deg if isinstance(task, Goto) else None
    return SetpointRequest(course, up_m, entry.leg, task.speed_m_s, yaw_deg, stays)
