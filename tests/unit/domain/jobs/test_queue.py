"""The queue of jobs: ordered, bounded, one job for each vehicle, nothing lost."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from app.domain.errors import JobQueueFullError, JobWrongStateError
from app.domain.jobs.job import NEXT, OVER, Job, JobState, after
from app.domain.jobs.queue import JobQueue, QueuePosition
from app.domain.run.run import RunState
from app.domain.vehicle.state import VehicleType
from tests.support.job_examples import a_job, a_run
from tests.support.reasons import some

CAPACITY = 4
VEHICLES = ("v1", "v2")


class QueueAndModel(RuleBasedStateMachine):
    """The model: for each priority a list of the ids that wait, and the id that each vehicle has."""

    def __init__(self) -> None:
        super().__init__()
        self.queue = JobQueue(capacity=CAPACITY)
        self.waiting: dict[int, list[str]] = {}
        self.vehicles: dict[str, str] = {}
        self.ended: dict[str, Job] = {}
        self.made = 0
        self.now = 0.0

    def _ids(self) -> list[str]:
        return [job_id for priority in sorted(self.waiting, reverse=True) for job_id in self.waiting[priority]]

    def _leave(self, job_id: str) -> int:
        (priority,) = (key for key, ids in self.waiting.items() if job_id in ids)
        self.waiting[priority].remove(job_id)
        return priority

    def _end(self, job: Job) -> None:
        self.ended[job.id] = job
        self.queue = self.queue.with_job(job)

    @rule(priority=st.integers(-1, 1), vehicle=st.sampled_from(("any", *VEHICLES)))
    def order(self, priority: int, vehicle: str) -> None:
        self.made += 1
        job = a_job(self.made, vehicle=vehicle, priority=priority, rank=self.queue.last_rank())
        if len(self._ids()) >= CAPACITY:
            with pytest.raises(JobQueueFullError):
                self.queue.added(job)
            return
        self.queue = self.queue.added(job)
        self.waiting.setdefault(priority, []).append(job.id)

    @rule(which=st.integers(0, 9), place=st.sampled_from(("first", "last", None)), priority=st.integers(-1, 1))
    def move(self, which: int, place: QueuePosition | None, priority: int) -> None:
        if not (ids := self._ids()):
            return
        job = self.queue.jobs[ids[which % len(ids)]]
        self.queue = self.queue.with_job(self.queue.placed(job, priority=priority, place=place, now=self.now))
        if place is None and priority == job.priority:
            return
        self._leave(job.id)
        others = self.waiting.setdefault(priority, [])
        others.insert(0 if place == "first" else len(others), job.id)

    @rule(which=st.integers(0, 9), other=st.integers(0, 9))
    def move_before(self, which: int, other: int) -> None:
        if not (ids := self._ids()):
            return
        job, next_job = (self.queue.jobs[ids[number % len(ids)]] for number in (which, other))
        self.queue = self.queue.with_jobs(self.queue.placed_before(job, next_job, now=self.now))
        if job.id != next_job.id:
            self._leave(job.id)
            others = self.waiting[next_job.priority]
            others.insert(others.index(next_job.id), job.id)

    @rule(vehicle=st.sampled_from(VEHICLES))
    def begin(self, vehicle: str) -> None:
        """What the scheduler does: the first that this vehicle may have, if it has none."""
        job = next((job for job in self.queue.due(self.now) if job.selector.allows(vehicle)), None)
        if job is None or self.queue.holder_of(vehicle) is not None:
            return
        wanted = [job_id for job_id in self._ids() if self.queue.jobs[job_id].selector.allows(vehicle)]
        assert job.id == wanted[0]
        self._leave(job.id)
        self.vehicles[vehicle] = job.id
        self.queue = self.queue.with_job(job.assigned(vehicle, f"run-{job.id}", (), now=self.now))

    @rule(vehicle=st.sampled_from(VEHICLES), state=st.sampled_from(RunState), flew=st.booleans())
    def look_at_run(self, vehicle: str, state: RunState, flew: bool) -> None:
        job = self.queue.holder_of(vehicle)
        if job is None or (job.state is JobState.FLYING and not flew):
            return
        followed = after(job, a_run(state, started_at=1.0 if flew else None), self.now)
        if followed.is_over:
            del self.vehicles[vehicle]
            self._end(followed)
        else:
            self.queue = self.queue.with_job(followed)

    @rule(vehicle=st.sampled_from(VEHICLES))
    def give_back(self, vehicle: str) -> None:
        job = self.queue.holder_of(vehicle)
        if job is None or job.state is not JobState.PREPARING:
            return
        del self.vehicles[vehicle]
        self.queue = self.queue.with_job(job.requeued("taken", now=self.now))
        others = self.waiting[job.priority]
        same = [one.id for one in self.queue.waiting if one.priority == job.priority]
        assert [job_id for job_id in same if job_id != job.id] == others, "it passes nobody else"
        self.waiting[job.priority] = same

    @rule(which=st.integers(0, 9), state=st.sampled_from((JobState.CANCELLED, JobState.EXPIRED)))
    def end_waiting(self, which: int, state: JobState) -> None:
        if ids := self._ids():
            job = self.queue.jobs[ids[which % len(ids)]]
            self._leave(job.id)
            self._end(job.moved_to(state, now=self.now, reason=some("because")))

    @invariant()
    def it_is_the_model(self) -> None:
        assert [job.id for job in self.queue.waiting] == self._ids()
        assert {job.vehicle_id: job.id for job in self.queue.active} == self.vehicles
        assert set(self.queue.jobs) == {*self._ids(), *self.vehicles.values()}
        assert all(job.is_over and job.ended_at is not None for job in self.ended.values())


TestQueueAndModel = QueueAndModel.TestCase
TestQueueAndModel.settings = settings(max_examples=40, stateful_step_count=30, deadline=None)


def test_what_is_over_stays_so() -> None:
    for state in OVER:
        assert NEXT[state] == frozenset()
        for following in JobState:
            with pytest.raises(JobWrongStateError):
                a_job(state=state).moved_to(following, now=1.0)


def test_a_job_that_is_not_due_or_too_late_is_not_begun() -> None:
    queue = JobQueue()
    for job in (a_job(1, not_before=10.0), a_job(2, deadline=5.0), a_job(3)):
        queue = queue.added(job)
    assert [job.id for job in queue.due(4.0)] == ["job-2", "job-3"]
    assert [job.id for job in queue.due(5.0)] == ["job-3"]
    assert [job.id for job in queue.due(10.0)] == ["job-1", "job-3"]


@settings(max_examples=20, deadline=None)
@given(moves=st.lists(st.integers(1, 5), min_size=60, max_size=120), other_priority=st.integers(-1, 1))
def test_any_number_of_moves_into_one_gap_keeps_the_order(moves: list[int], other_priority: int) -> None:
    """A float between two ranks can be halved about fifty times."""
    queue, target = JobQueue().with_jobs(a_job(number) for number in range(1, 8)), "job-6"
    queue = queue.with_job(a_job(8, priority=other_priority, rank=3.5))
    expected = [job.id for job in queue.waiting]
    for number in moves:
        job = queue.jobs[f"job-{number}"]
        queue = queue.with_jobs(queue.placed_before(job, queue.jobs[target], now=2.0))
        expected.remove(job.id)
        expected.insert(expected.index(target), job.id)
        assert [one.id for one in queue.waiting] == expected
        assert len({one.place for one in queue.waiting}) == len(expected), "no two have the same place"


def test_a_job_waits_for_vehicles_of_its_type_alone() -> None:
    wing = VehicleType.FIXED_WING
    queue = JobQueue().with_jobs(
        (a_job(1), a_job(2, vehicle_type=wing), a_job(3, vehicle="v2"), a_job(4, vehicle="v2", vehicle_type=wing))
    )
    assert queue.waiting_for("v1", VehicleType.MULTICOPTER) == ("job-1",)
    assert queue.waiting_for("v2", wing) == ("job-2", "job-4")
    assert queue.waiting_for("v2", None) == ("job-1", "job-2", "job-3", "job-4"), "it may turn out to be of any type"


def test_equal_ranks_are_resolved_by_the_next_move_between_them() -> None:
    queue = JobQueue().with_jobs(a_job(number, rank=1) for number in (1, 2, 3))
    queue = queue.with_jobs(queue.placed_before(queue.jobs["job-3"], queue.jobs["job-2"], now=2.0))
    assert [(job.id, job.rank) for job in queue.waiting] == [("job-1", 1), ("job-3", 2), ("job-2", 3)]
