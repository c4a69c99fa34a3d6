"""Jobs, candidates and queues as tables in a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

from rich.markup import escape
from rich.table import Table

from app.domain.jobs.candidate import Candidate, Refusal
from app.domain.jobs.job import Job
from app.domain.reason import in_words
from app.services.jobs.views import VehicleQueueView


def jobs_table(jobs: Sequence[Job]) -> Table:
    """One line for each job."""
    table = _table("job", "plan", "vehicle", "state", "priority", "deadline", "run", "reason")
    for job in jobs:
        vehicle = job.vehicle_id or (", ".join(job.wish.named) if job.wish.named else job.wish.vehicle)
        row = (job.id, job.plan_name, vehicle, job.state.value, str(job.priority), _time(job.deadline))
        table.add_row(*(escape(cell) for cell in (*row, job.run_id or "", in_words(job.reason))))
    return table


def candidates_table(candidates: Sequence[Candidate]) -> Table:
    """One line for each vehicle, with everything that speaks against it."""
    table = _table("vehicle", "chosen", "distance", "battery", "why")
    for one in candidates:
        against = [f"{refusal.code}: {_refusal(refusal)}" for refusal in one.refusals]
        left_out = [f"and {one.refusals_left_out} more"] if one.refusals_left_out else []
        distance = "" if one.distance_m is None else f"{one.distance_m:.0f} m"
        battery = "" if one.battery_percent is None else f"{one.battery_percent:.0f} %"
        why = "; ".join([*against, *left_out]) or in_words(one.reason)
        table.add_row(*(escape(cell) for cell in (one.vehicle_id, "yes" if one.chosen else "", distance, battery, why)))
    return table


def _refusal(refusal: Refusal) -> str:
    return refusal.message if refusal.reason is None else f"{refusal.message}: {in_words(refusal.reason)}"


def queues_table(queues: Sequence[VehicleQueueView]) -> Table:
    """One line for each vehicle."""
    table = _table("vehicle", "queue", "job", "waiting", "why not ready")
    for view in queues:
        state = "stopped" if view.queue.stopped else ("ready" if view.ready else "not ready")
        why = "; ".join(_refusal(refusal) for refusal in view.refusals)
        row = (view.queue.vehicle_id, state, view.job_id or "", str(len(view.waiting)), why)
        table.add_row(*(escape(cell) for cell in row))
    return table


def _table(*names: str) -> Table:
    table = Table()
    for name in names:
        table.add_column(name, no_wrap=name in ("job", "vehicle", "run"))
    return table


def _time(seconds: float | None) -> str:
    return (
        "" if seconds is None else datetime.fromtimestamp(seconds).astimezone().isoformat(sep=" ", timespec="seconds")
    )
