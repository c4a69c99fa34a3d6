"""The laws of the task queue, against a model that is a plain list."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from app.domain.errors import NotFoundError, TaskQueueFullError
from app.domain.offboard.tasks.admission import course_of
from app.domain.offboard.tasks.forms import TASK_NUMBERS, InsertMode, Task
from app.domain.offboard.tasks.queue import TaskQueue
from tests.support.task_examples import ORIGIN, task, tasks

CAPACITY = 4
PLACES = st.integers(0, CAPACITY)
"""One more than there are: an id that is not in the queue."""
UNKNOWN = "t0"
MODES: tuple[InsertMode, ...] = ("append", "prepend", "replace_current", "replace_all")


def queue_of(*kinds: str) -> TaskQueue:
    queue = TaskQueue(CAPACITY)
    for kind in kinds:
        one = task(kind)
        queue = queue.insert(one, course_of(one, ORIGIN, 0.0), "append")
    return queue


class QueueAndModel(RuleBasedStateMachine):
    """The model: a list of (id, task), how many were ever made, and the time of the first."""

    def __init__(self) -> None:
        super().__init__()
        self.queue = TaskQueue(CAPACITY)
        self.model: list[tuple[str, Task]] = []
        self.made = 0
        self.elapsed_s = 0.0

    @rule(one=tasks(), mode=st.sampled_from(MODES))
    def insert(self, one: Task, mode: InsertMode) -> None:
        entry = (f"t{self.made + 1}", one)
        wanted = {
            "append": [*self.model, entry],
            "prepend": [entry, *self.model],
            "replace_current": [entry, *self.model[1:]],
            "replace_all": [entry],
        }[mode]
        if len(wanted) > CAPACITY:
            with pytest.raises(TaskQueueFullError):
                self.queue.insert(one, course_of(one, ORIGIN, 0.0), mode)
            return
        self.queue = self.queue.insert(one, course_of(one, ORIGIN, 0.0), mode)
        self.elapsed_s = self.elapsed_s if mode == "append" else 0.0
        self.model, self.made = wanted, self.made + 1

    @rule()
    def next(self) -> None:
        self.queue, self.model, self.elapsed_s = self.queue.next(), self.model[1:], 0.0

    @rule(which=PLACES, where=st.none() | PLACES)
    def reorder(self, which: int, where: int | None) -> None:
        task_id, before = self.id_at(which), None if where is None else self.id_at(where)
        if UNKNOWN in (task_id, before):
            with pytest.raises(NotFoundError):
                self.queue.reordered(task_id, before)
            return
        wanted = list(self.model)
        if task_id != before:
            moved = wanted.pop(which)
            wanted.insert(next((i for i, entry in enumerate(wanted) if entry[0] == before), len(wanted)), moved)
        self.queue = self.queue.reordered(task_id, before)
        self.elapsed_s = self.elapsed_s if wanted[0] is self.model[0] else 0.0
        self.model = wanted

    @rule(which=PLACES)
    def remove(self, which: int) -> None:
        task_id = self.id_at(which)
        if task_id == UNKNOWN:
            with pytest.raises(NotFoundError):
                self.queue.without(task_id)
            return
        self.queue = self.queue.without(task_id)
        self.elapsed_s = 0.0 if which == 0 else self.elapsed_s
        del self.model[which]

    def id_at(self, place: int) -> str:
        return self.model[place][0] if place < len(self.model) else UNKNOWN

    @rule(which=PLACES, duration_s=st.floats(0.5, 30.0))
    def mend(self, which: int, duration_s: float) -> None:
        if which >= len(self.model):
            return
        entry, (task_id, one) = self.queue.entries[which], self.model[which]
        mended = one.model_copy(update={"duration_s": duration_s})
        self.queue = self.queue.with_entry(replace(entry, task=mended))
        self.model[which] = (task_id, mended)

    @rule()
    def clear(self) -> None:
        self.queue, self.model, self.elapsed_s = self.queue.cleared(), [], 0.0

    @rule(seconds=st.floats(0.0, 20.0))
    def fly(self, seconds: float) -> None:
        self.queue = self.queue.flown(seconds)
        self.elapsed_s += seconds if self.model else 0.0

    @rule(leg=st.integers(0, 3), up_m=st.floats(0.0, 100.0))
    def begin(self, leg: int, up_m: float) -> None:
        self.queue = self.queue.begun(up_m, leg)

    @invariant()
    def is_as_the_model(self) -> None:
        assert [(entry.id, entry.task) for entry in self.queue.entries] == self.model
        assert self.queue.task_list == (tuple(TASK_NUMBERS[one.type] for _, one in self.model) or (0,))
        assert len(self.model) <= CAPACITY

    @invariant()
    def time_is_the_current_tasks_alone(self) -> None:
        assert self.queue.elapsed_s == self.elapsed_s
        limit_s = self.model[0][1].duration_s if self.model else -1.0
        if limit_s <= 0.0:
            assert self.queue.remaining_s == -1.0
            assert not self.queue.is_over_time, "a task without a limit never ends by time"
        else:
            assert self.queue.remaining_s == max(0.0, limit_s - self.elapsed_s)
            assert self.queue.is_over_time == (self.elapsed_s >= limit_s)


TestQueueAndModel = QueueAndModel.TestCase
TestQueueAndModel.settings = settings(max_examples=40, stateful_step_count=30)


def test_a_prepended_task_is_flown_before_the_current_one_which_stays() -> None:
    queue = queue_of("segment", "goto").insert(task("circle"), course_of(task("circle"), ORIGIN, 0.0), "prepend")
    assert queue.task_list == (2, 3, 1)
    assert queue.next().task_list == (3, 1)


def test_a_path_that_was_interrupted_goes_on_on_its_leg_and_at_its_height() -> None:
    queue = queue_of("path").begun(31.0, 1)
    queue = queue.insert(task("goto"), course_of(task("goto"), ORIGIN, 0.0), "prepend").begun(50.0, 0).next()
    assert queue.current is not None
    assert (queue.current.leg, queue.current.up_m) == (1, 31.0)


def test_a_full_queue_refuses_with_its_size_and_takes_what_replaces() -> None:
    queue = queue_of("goto", "goto", "goto", "goto")
    one = task("circle")
    with pytest.raises(TaskQueueFullError) as full:
        queue.insert(one, course_of(one, ORIGIN, 0.0), "append")
    assert full.value.extra["capacity"] == CAPACITY
    assert queue.insert(one, course_of(one, ORIGIN, 0.0), "replace_current").task_list == (2, 1, 1, 1)


def test_a_target_that_moves_keeps_its_place_in_the_queue_and_its_time() -> None:
    queue = queue_of("goto", "circle").flown(3.0)
    other = task("goto", point={"east_m": 0.0, "north_m": 0.0})
    moved = queue.moved("t1", other, course_of(other, ORIGIN, 0.0))
    assert (moved.elapsed_s, moved.entries[0].task, moved.entries[1]) == (3.0, other, queue.entries[1])


def test_a_task_that_is_moved_to_the_front_is_flown_and_the_one_that_was_begins_anew_on_its_leg() -> None:
    queue = queue_of("path", "goto", "circle").begun(31.0, 1).flown(5.0)
    moved = queue.reordered("t3", "t1")
    assert ([entry.id for entry in moved.entries], moved.elapsed_s) == (["t3", "t1", "t2"], 0.0)
    assert (moved.entries[1].leg, moved.entries[1].up_m) == (1, 31.0)


def test_what_is_moved_or_removed_behind_the_current_task_leaves_its_time_alone() -> None:
    queue = queue_of("path", "goto", "circle", "segment").flown(5.0)
    moved = queue.reordered("t2", None)
    assert ([entry.id for entry in moved.entries], moved.elapsed_s) == (["t1", "t3", "t4", "t2"], 5.0)
    assert ([entry.id for entry in queue.without("t3").entries], queue.without("t3").elapsed_s) == (
        ["t1", "t2", "t4"],
        5.0,
    )
    assert queue.reordered("t2", "t2") is queue.reordered("t2", "t3") is queue, "where it is already it stays"
