"""Whether a job's deadline has passed for good: the time of day may jump, and jump back."""

from __future__ import annotations

from collections.abc import Container

from app.domain.jobs.job import Job
from app.services.clock import Clock


class Deadlines:
    """Asked at each poll. A job ends only once the time of day has been past its deadline for `late_for_s`.

    It is started no later for that: every start looks at the time of day itself.
    """

    def __init__(self, clock: Clock, late_for_s: float) -> None:
        self._clock = clock
        self._late_for_s = late_for_s
        self._late_since_s: dict[str, float] = {}

    def has_passed(self, job: Job) -> bool:
        if not job.is_late(self._clock.now()):
            self._late_since_s.pop(job.id, None)
            return False
        now_s = self._clock.monotonic()
        return now_s - self._late_since_s.setdefault(job.id, now_s) >= self._late_for_s

    def keep(self, open_ids: Container[str]) -> None:
        """Forget the jobs that have ended."""
        self._late_since_s = {job_id: since_s for job_id, since_s in self._late_since_s.items() if job_id in open_ids}
