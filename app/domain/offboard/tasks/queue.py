"""The task queue as a pure state machine: insertion, the current task, and its remaining time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from app.domain.errors import NotFoundError, TaskQueueFullError
from app.domain.offboard.tasks.course import Course
from app.domain.offboard.tasks.forms import EMPTY_LIST, TASK_NUMBERS, UNLIMITED_S, InsertMode, Task

CAPACITY: Final = 20
"""As many as Paparazzi's circular buffer has places."""


@dataclass(frozen=True, slots=True)
class QueuedTask:
    """One task with its place in the vehicle's local frame.

    `up_m` is above the EKF origin, None: as high as the vehicle is when it begins. `leg`: of a path, the one flown now.
    """

    id: str
    task: Task
    course: Course
    up_m: float | None = None
    leg: int = 0


@dataclass(frozen=True, slots=True)
class TaskQueue:
    """The first entry is the current one, `elapsed_s` how long it has been flown. Ids are never used twice.

    Laws: a task that stops being current without ending (prepend, reordered) begins anew when its turn comes again,
    with its whole duration, on the leg where it was; what is not current has no time; at most `capacity` tasks, and
    what does not fit changes nothing.
    """

    capacity: int = CAPACITY
    entries: tuple[QueuedTask, ...] = ()
    elapsed_s: float = 0.0
    made: int = 0

    @property
    def current(self) -> QueuedTask | None:
        """The task that is flown; None when the queue is empty."""
        return self.entries[0] if self.entries else None

    @property
    def remaining_s(self) -> float:
        """Of the current task; -1 if it has no limit or there is none."""
        if self.current is None or self.current.task.duration_s <= 0.0:
            return UNLIMITED_S
        return max(0.0, self.current.task.duration_s - self.elapsed_s)

    @property
    def task_list(self) -> tuple[int, ...]:
        """The types, current first; [0] when empty."""
        return tuple(TASK_NUMBERS[entry.task.type] for entry in self.entries) or EMPTY_LIST

    @property
    def is_over_time(self) -> bool:
        """Whether the current task has lasted as long as it may."""
        return self.remaining_s == 0.0

    def insert(self, task: Task, course: Course, mode: InsertMode, up_m: float | None = None) -> TaskQueue:
        """The queue with one task more, or in the place of others. In an empty queue all modes are alike.

        Raises:
            TaskQueueFullError: it has no place; nothing was changed.
        """
        entry = QueuedTask(f"t{self.made + 1}", task, course, up_m)
        rest, elapsed_s = self.entries, self.elapsed_s
        if mode == "append":
            entries = (*rest, entry)
        else:
            kept = {"prepend": rest, "replace_current": rest[1:], "replace_all": ()}[mode]
            entries, elapsed_s = (entry, *kept), 0.0
        if len(entries) > self.capacity:
            raise TaskQueueFullError(
                f"the queue has {self.capacity} tasks, and no place for another",
                hint="wait for one to end, replace one, or clear the queue",
                capacity=self.capacity,
            )
        return replace(self, entries=entries, elapsed_s=elapsed_s, made=self.made + 1)

    def flown(self, seconds: float) -> TaskQueue:
        """Add flight time to the current task. It does not end the task: see `is_over_time`."""
        return replace(self, elapsed_s=self.elapsed_s + seconds) if self.entries else self

    def next(self) -> TaskQueue:
        """End or skip the current task."""
        return replace(self, entries=self.entries[1:], elapsed_s=0.0)

    def cleared(self) -> TaskQueue:
        """No task is left."""
        return replace(self, entries=(), elapsed_s=0.0)

    def reordered(self, task_id: str, before: str | None) -> TaskQueue:
        """The task with this id stands before that other one, or last; the rest keep their order. Self if they all do.

        Raises:
            NotFoundError: one of the two is not in the queue.
        """
        entry, other = self.entry(task_id), None if before is None else self.entry(before)
        if entry is other:
            return self
        rest = tuple(one for one in self.entries if one is not entry)
        place = len(rest) if other is None else rest.index(other)
        entries = (*rest[:place], entry, *rest[place:])
        return self if entries == self.entries else self._with(entries)

    def without(self, task_id: str) -> TaskQueue:
        """Remove the task with this ID. Raises NotFoundError."""
        entry = self.entry(task_id)
        return self._with(tuple(other for other in self.entries if other is not entry))

    def entry(self, task_id: str) -> QueuedTask:
        """The task with this id. Raises NotFoundError."""
        for entry in self.entries:
            if entry.id == task_id:
                return entry
        raise NotFoundError(f"no task {task_id!r} is in the queue", hint="it has ended or was taken out, or never was")

    def begun(self, up_m: float, leg: int) -> TaskQueue:
        """The current task is flown at this height, and has come to this leg of its path."""
        if self.current is None or (self.current.up_m, self.current.leg) == (up_m, leg):
            return self
        return replace(self, entries=(replace(self.current, up_m=up_m, leg=leg), *self.entries[1:]))

    def moved(self, task_id: str, task: Task, course: Course) -> TaskQueue:
        """The task with this id is about another place now, and keeps its time."""
        return self.with_entry(replace(self.entry(task_id), task=task, course=course))

    def with_entry(self, entry: QueuedTask) -> TaskQueue:
        """Replace the entry with the same ID; the elapsed time continues. Without such an entry nothing changes."""
        return replace(self, entries=tuple(entry if one.id == entry.id else one for one in self.entries))

    def _with(self, entries: tuple[QueuedTask, ...]) -> TaskQueue:
        """These entries; the time goes on if the current task is the same."""
        same = bool(entries) and entries[0] is self.current
        return replace(self, entries=entries, elapsed_s=self.elapsed_s if same else 0.0)
