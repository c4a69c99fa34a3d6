"""The task queues of the whole fleet: one for each vehicle that was ever asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from app.domain.errors import ConflictError, LeaseLostError, TaskActiveError, TaskRefusedError
from app.domain.offboard.control_method import ControlMethod, task_control_method
from app.domain.offboard.state import OffboardState
from app.domain.offboard.tasks.admission import course_of, refuse_beyond
from app.domain.offboard.tasks.course import Course, EkfOrigin
from app.domain.offboard.tasks.forms import Circle, Goto, InsertMode, Motion, Task, TaskPoint, TaskTerms, WhenEmpty
from app.domain.offboard.tasks.queue import QueuedTask
from app.domain.ports.vehicle_link import Unsubscribe
from app.domain.reasons import Reason, ReasonCode
from app.services.clock import Clock
from app.services.fleet import Fleet
from app.services.offboard import Offboard
from app.services.offboard.preflight import ControlContext
from app.services.runs import Runs
from app.services.tasks.flight import Phase, TaskFlight
from app.services.views import ControlMethodName, OriginView, QueuedTaskView, TaskReport, TasksView

NEVER_USED = TaskReport(state="idle", remaining_s=-1.0, task_list=[0], current_id=None, reason=None)


class TaskQueueService:
    """All methods that take a `lease_id` may raise LeaseLostError."""

    def __init__(self, flight: TaskFlight, clock: Clock) -> None:
        self._flight = flight
        self._clock = clock

    def insert(
        self, lease_id: str, task: Task, mode: InsertMode = "append", when_empty: WhenEmpty | None = None
    ) -> QueuedTask:
        """Queue a task: flown when its turn comes and the vehicle is under offboard control.

        Raises:
            TaskRefusedError, TaskQueueFullError: nothing has changed. ConflictError: control goes back to the plan
            already, or the task in whose place it would be flown works the gripper now, and would do so again.
        """
        flight = self._own(lease_id)
        if mode != "append":
            self._refuse_while_gripping("append the task")
        course, up_m = self._admit(task)
        queue = flight.queue.insert(task, course, mode, up_m)
        entry = queue.entries[-1 if mode == "append" else 0]
        flight.put(queue, "inserted", entry, mode, when_empty)
        return entry

    def skip(self, lease_id: str) -> None:
        """On to the next task. Raises ConflictError if there is none to leave."""
        flight = self._own(lease_id)
        if flight.queue.current is None:
            raise ConflictError("the queue is empty: there is nothing to skip")
        flight.finish("skipped")

    def move(self, lease_id: str, task_id: str, before: str | None) -> None:
        """Another place in the queue: before that other task, or last. What becomes the first is flown at once.

        Raises:
            NotFoundError: one of them is not in the queue. ConflictError: the current task works the gripper, and would
            lose its place.
        """
        flight = self._own(lease_id)
        queue = flight.queue.reordered(task_id, before)
        if queue.current is not flight.queue.current:
            self._refuse_while_gripping("move it later")
        if queue is not flight.queue:
            flight.put(queue, "moved", queue.entry(task_id))

    def change(self, lease_id: str, task_id: str, terms: TaskTerms) -> None:
        """Change the terms of a task that has not started; it keeps its position, its course and its leg.

        Raises:
            NotFoundError: it has ended, or never existed. TaskActiveError: it is being flown. TaskRefusedError: it is
            unchanged.
        """
        flight = self._own(lease_id)
        found = flight.queue.entry(task_id)
        if found is flight.queue.current and flight.control.state is not OffboardState.LEASED:
            raise TaskActiveError(
                f"task {task_id} is already being flown",
                hint="queue another with replace_current, or move another task before it first",
            )
        task = terms.applied(found.task)
        if task == found.task:
            return
        course, up_m = self._admit(task)
        entry = replace(
            found,
            task=task,
            course=course if isinstance(task, Circle) else found.course,
            up_m=up_m if terms.gives_altitude else found.up_m,
        )
        flight.put(flight.queue.with_entry(entry), "changed", entry)

    def remove(self, lease_id: str, task_id: str) -> None:
        """Take one task out; the current one as if it were skipped. Raises NotFoundError."""
        flight = self._own(lease_id)
        entry = flight.queue.entry(task_id)
        flight.put(flight.queue.without(task_id), "removed", entry)

    def clear(self, lease_id: str) -> None:
        """Drop all tasks; what happens then is as when the last one ends."""
        flight = self._own(lease_id)
        if flight.queue.entries:
            flight.put(flight.queue.cleared(), "cleared", None)

    def pause(self, lease_id: str) -> None:
        """Stand (a wing circles); the current task keeps its time. Raises ConflictError if nothing is flown."""
        flight = self._own(lease_id)
        if flight.phase not in (Phase.FLYING, Phase.MANUAL):
            raise ConflictError(f"the queue is {flight.phase.value}: there is nothing to pause")
        flight.stop("paused", Reason.of(ReasonCode.TASK_PAUSED))

    def resume(self, lease_id: str) -> None:
        """Go on with the current task. Raises ConflictError if the queue was not stopped."""
        flight = self._own(lease_id)
        if flight.phase not in (Phase.PAUSED, Phase.MANUAL):
            raise ConflictError(f"the queue is {flight.phase.value}: there is nothing to resume")
        flight.go_on()

    def retarget(self, lease_id: str, task_id: str, point: TaskPoint, motion: Motion | None) -> None:
        """Where the target of a goto is now, and how it moves.

        Raises:
            TaskRefusedError, NotFoundError, ConflictError: the target stays as it was.
        """
        flight = self._own(lease_id)
        found = flight.queue.entry(task_id)
        if not isinstance(found.task, Goto) or found.task.gripper is not None:
            raise ConflictError(f"task {task_id} has no movable target: only a goto without a gripper action has one")
        task = found.task.model_copy(update={"point": point, "motion": motion})
        course, _ = self._admit(task)
        flight.move_target(task_id, task, course)

    def view(self) -> TasksView:
        flight = self._flight
        origin = flight.origin or EkfOrigin.of(flight.control.link.state())
        shown = None if origin is None else OriginView.of(origin)
        return TasksView(
            report=flight.report() or NEVER_USED,
            origin=shown,
            when_empty=flight.when_empty,
            control_method=self._control_method(),
            capacity=flight.queue.capacity,
            tasks=[self._entry_view(entry) for entry in flight.queue.entries],
        )

    @property
    def changes(self) -> int:
        """How often the queue has changed; 0 while nobody has ever used it."""
        return self._flight.changes

    def subscribe(self, listener: Callable[[], None]) -> Unsubscribe:
        """Call `listener` when state, lease or queue have changed."""
        return self._flight.control.subscribe(listener)

    def _control_method(self) -> ControlMethodName | None:
        """By the lease; without a lease as the vehicle flies now."""
        control = self._flight.control
        if control.lease is not None:
            return control.control_method.value
        who = control.link.identity
        if who.vehicle_type is None:
            return None
        control_method = ControlContext.of(who.vehicle_type, who.firmware, control.settings.fresh_s).control_method(
            control.link.state()
        )
        return None if control_method is None else control_method.value

    def _own(self, lease_id: str) -> TaskFlight:
        """The queue of this lease; a new lease begins with an empty one."""
        flight = self._flight
        lease = flight.control.require(lease_id)
        if flight.phase is Phase.ENDING:
            raise ConflictError("no tasks were left: control returns to the plan", hint="acquire the lease again")
        flight.take_over(lease.id)
        return flight

    def _refuse_while_gripping(self, instead: str) -> None:
        """Raises ConflictError where another task would take the place of one that works the gripper."""
        if self._flight.is_gripping:
            raise ConflictError(
                "the current task is operating the gripper: repeating it would do so twice",
                hint=f"wait for the gripper's answer, {instead}, or skip the current one",
            )

    def _admit(self, task: Task) -> tuple[Course, float | None]:
        flight = self._flight
        control, context = flight.control, flight.control.context
        if context is None:
            raise LeaseLostError("the lease has ended")
        state = control.link.state()
        control_method = task_control_method(context.kind(state), context.profile)
        is_entered = control.state is not OffboardState.LEASED
        if (
            is_entered
            and control_method is ControlMethod.COMMANDS
            and control.control_method is ControlMethod.SETPOINTS
        ):
            raise TaskRefusedError(
                "offboard control was entered with setpoints, but this vehicle supports none that tasks need",
                refusal="task.entered_by_setpoints",
                hint="leave, then enter without `control_method`",
            )
        origin = flight.origin or EkfOrigin.of(state)
        if origin is None or state.home is None:
            raise TaskRefusedError(
                "the vehicle has not reported its home in local coordinates, so its EKF origin is unknown",
                refusal="task.origin_unknown",
                hint="wait for the position",
            )
        flight.set_origin(origin)
        course, up_m = course_of(task, origin, self._clock.monotonic()), origin.up_of(task, state.home.altitude_m)
        wing = context.wing if control_method is ControlMethod.COMMANDS else None
        refuse_beyond(task, course, up_m, control.settings.limits, context.pose(state), wing)
        return course, up_m

    def _entry_view(self, entry: QueuedTask) -> QueuedTaskView:
        flight = self._flight
        is_current = flight.queue.current is entry
        seen = flight.seen if is_current else None
        limit_s = entry.task.duration_s if entry.task.duration_s > 0.0 else -1.0
        remaining_m = None if seen is None or seen.remaining_m == float("inf") else round(seen.remaining_m, 2)
        return QueuedTaskView(
            id=entry.id,
            task=entry.task,
            remaining_s=round(flight.queue.remaining_s, 1) if is_current else limit_s,
            leg=entry.leg,
            cross_m=None if seen is None else round(seen.cross_m, 2),
            remaining_m=remaining_m,
        )


class Tasks:
    """The registry."""

    def __init__(self, offboard: Offboard, fleet: Fleet, runs: Runs, clock: Clock) -> None:
        self._offboard = offboard
        self._fleet = fleet
        self._runs = runs
        self._clock = clock
        self._services: dict[str, TaskQueueService] = {}

    def vehicle(self, vehicle_id: str) -> TaskQueueService:
        """The queue of one vehicle. Raises NotFoundError."""
        control = self._offboard.vehicle(vehicle_id)
        if vehicle_id not in self._services:
            flight = TaskFlight(control, self._fleet, self._runs)
            self._services[vehicle_id] = TaskQueueService(flight, self._clock)
        return self._services[vehicle_id]
