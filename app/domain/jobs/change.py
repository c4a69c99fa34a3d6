"""What an event of a job says has happened: in a word, by what differs."""

from __future__ import annotations

from typing import Final, Literal

from app.domain.jobs.job import Job, JobState

JobChangeWord = Literal[
    "queued",
    "placed",
    "assigned",
    "requeued",
    "prepared",
    "start_asked",
    "started",
    "end_asked",
    "noted",
    "ended",
]
_BY_STATE: Final[dict[JobState, JobChangeWord]] = {
    JobState.QUEUED: "requeued",
    JobState.PREPARING: "assigned",
    JobState.PREPARED: "prepared",
    JobState.FLYING: "started",
}


def change_word(before: Job | None, after: Job) -> JobChangeWord:
    """`noted`: only the reason differs."""
    if before is None:
        return "queued"
    if after.state is not before.state:
        return _BY_STATE.get(after.state, "ended")
    if after.place != before.place:
        return "placed"
    if after.end_asked and not before.end_asked:
        return "end_asked"
    return "start_asked" if after.start_asked_at is not None and before.start_asked_at is None else "noted"
