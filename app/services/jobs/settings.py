"""What can be set of jobs. Seconds of our time."""

from __future__ import annotations

from dataclasses import dataclass

from app.domain.jobs.queue import MAX_WAITING


@dataclass(frozen=True, slots=True, kw_only=True)
class JobSettings:
    """`look_every_s`: how often the queue is looked at, besides when somebody changes it.

    `look_again_s`: a job that no vehicle could take, or whose vehicle failed it, is not tried again sooner.
    `facts_s`: how long a vehicle that was never asked before may take to tell its parameters; it is asked on meanwhile.
    """

    capacity: int = MAX_WAITING
    look_every_s: float = 0.5
    look_again_s: float = 3.0
    facts_s: float = 5.0
