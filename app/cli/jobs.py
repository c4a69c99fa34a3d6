"""`waydrop jobs`: queue plans for a vehicle or for any that can, and look after the queues."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from app.cli.plan_report import WindOption, read_plan, wind_given
from app.cli.runs import JsonOption
from app.cli.service_client import Query, ServerOption, TokenOption, parsed, with_client
from app.cli.terminal import ExitStatus, err, out, write_json
from app.cli.times import time_option
from app.domain.jobs.job import Candidate, Job, JobState, Refusal
from app.domain.jobs.queue import QueuePosition
from app.domain.reasons import describe
from app.services.jobs.views import LEAST_BATTERY_PERCENT, AssignmentView, JobQueuesView, VehicleQueueView


def jobs_table(jobs: Sequence[Job]) -> Table:
    table = _table("job", "plan", "vehicle", "state", "priority", "deadline", "run", "reason")
    for job in jobs:
        vehicle = job.vehicle_id or (", ".join(job.selector.named) if job.selector.named else job.selector.vehicle)
        row = (job.id, job.plan_name, vehicle, job.state.value, str(job.priority), _time(job.deadline))
        table.add_row(*(escape(cell) for cell in (*row, job.run_id or "", describe(job.reason))))
    return table


def candidates_table(candidates: Sequence[Candidate]) -> Table:
    """One line for each vehicle, with everything that speaks against it."""
    table = _table("vehicle", "chosen", "distance", "battery", "why")
    for one in candidates:
        against = [f"{refusal.code}: {_refusal(refusal)}" for refusal in one.refusals]
        left_out = [f"and {one.omitted_refusals} more"] if one.omitted_refusals else []
        distance = "" if one.distance_m is None else f"{one.distance_m:.0f} m"
        battery = "" if one.battery_percent is None else f"{one.battery_percent:.0f} %"
        why = "; ".join([*against, *left_out]) or describe(one.reason)
        table.add_row(*(escape(cell) for cell in (one.vehicle_id, "yes" if one.chosen else "", distance, battery, why)))
    return table


def _refusal(refusal: Refusal) -> str:
    return refusal.message if refusal.reason is None else f"{refusal.message}: {describe(refusal.reason)}"


def queues_table(queues: Sequence[VehicleQueueView]) -> Table:
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
    if seconds is None:
        return ""
    try:
        return datetime.fromtimestamp(seconds).astimezone().isoformat(sep=" ", timespec="seconds")
    except (ValueError, OverflowError, OSError):  # beyond the calendar here
        return f"{seconds:.0f} s after 1970"


jobs_app = typer.Typer(help="Queue plans for one vehicle or any suitable one.", no_args_is_help=True)
JobArgument = Annotated[str, typer.Argument(metavar="JOB", help="The job's id.")]
VehicleArgument = Annotated[str, typer.Argument(metavar="VEHICLE", help="The vehicle's id.")]


class PlaceOption(StrEnum):
    """Where among the waiting jobs of its priority."""

    FIRST = "first"
    LAST = "last"


@jobs_app.command()
def add(
    plan: Annotated[
        str, typer.Argument(metavar="PLAN", help="A plan file, - for standard input, or the ID of a plan.")
    ],
    server: ServerOption,
    token: TokenOption = None,
    vehicle: Annotated[str, typer.Option("--vehicle", metavar="ID", help="A vehicle, or any.")] = "any",
    allow: Annotated[
        list[str] | None, typer.Option(metavar="ID", help="With any: only this vehicle; repeatable.")
    ] = None,
    min_battery: Annotated[
        float, typer.Option("--min-battery", min=0, max=100, help="Minimum battery charge in percent.")
    ] = LEAST_BATTERY_PERCENT,
    not_before: Annotated[str | None, time_option("Begin then: 2026-05-01T08:00:00Z, or Unix seconds.")] = None,
    deadline: Annotated[str | None, time_option("The latest start.")] = None,
    wind: WindOption = None,
    priority: Annotated[int, typer.Option(min=-100, max=100, help="Higher priorities come first.")] = 0,
    auto_start: Annotated[
        bool, typer.Option("--auto-start", help="Start the run once it is prepared, without an operator.")
    ] = False,
    check: Annotated[bool, typer.Option("--check", help="Only show which vehicle would be chosen.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Queue a plan. With --check exit status 1 if no vehicle could take it now."""
    given = wind_given(wind)
    order: dict[str, Any] = {
        "plan": _plan(plan),
        "vehicle": vehicle,
        "allowed_vehicles": allow or [],
        "min_battery_percent": min_battery,
        "not_before": not_before,
        "deadline": deadline,
        "wind": None if given is None else given.model_dump(mode="json"),
        "priority": priority,
        "auto_start": auto_start,
    }
    path = "/job-checks" if check else "/jobs"
    answer = with_client(server, token, lambda client: client.post(path, order))
    if as_json:
        write_json(answer)
    elif check:
        out().print(candidates_table(parsed(AssignmentView, answer).candidates))
    else:
        _show(parsed(Job, answer))
    if answer["warning"]:
        err().print(f"warning: {answer['warning']}", markup=False)
    if check and answer["vehicle_id"] is None:
        err().print("no vehicle is available now")
        raise typer.Exit(ExitStatus.NOT_ACHIEVED)


@jobs_app.command("list")
def list_jobs(
    server: ServerOption,
    token: TokenOption = None,
    state: Annotated[list[JobState] | None, typer.Option(help="Jobs in this state; repeatable.")] = None,
    vehicle: Annotated[str | None, typer.Option(metavar="ID", help="Jobs of this vehicle.")] = None,
    plan: Annotated[str | None, typer.Option(metavar="ID", help="Jobs of this plan.")] = None,
    open_only: Annotated[bool, typer.Option("--open", help="Only jobs that have not ended.")] = False,
    limit: Annotated[int, typer.Option(min=1, max=500, help="Maximum number of results, newest first.")] = 20,
    as_json: JsonOption = False,
) -> None:
    """List jobs, newest first."""
    states = ",".join(state) if state else None
    wanted: dict[str, Query] = {"vehicle": vehicle, "plan": plan, "state": states, "limit": limit}
    wanted["open"] = "true" if open_only else None
    answer = with_client(server, token, lambda client: client.get("/jobs", **wanted))
    if as_json:
        write_json(answer)
    elif not answer["jobs"]:
        err().print("no such jobs")
    else:
        out().print(jobs_table([parsed(Job, row) for row in answer["jobs"]]))


@jobs_app.command()
def show(job: JobArgument, server: ServerOption, token: TokenOption = None, as_json: JsonOption = False) -> None:
    """Show one job, and what speaks for and against each vehicle."""
    answer = with_client(server, token, lambda client: client.get(f"/jobs/{job}"))
    if as_json:
        write_json(answer)
    else:
        _show(parsed(Job, answer))


@jobs_app.command()
def cancel(job: JobArgument, server: ServerOption, token: TokenOption = None) -> None:
    """Cancel a job that is not flying. A run that waits for its start is aborted."""
    _show(parsed(Job, with_client(server, token, lambda client: client.post(f"/jobs/{job}/cancel"))))


@jobs_app.command()
def clear_claim(job: JobArgument, server: ServerOption, token: TokenOption = None) -> None:
    """Take a job from a gateway that does not answer. Make sure that the gateway does not fly it later."""
    _show(parsed(Job, with_client(server, token, lambda client: client.post(f"/jobs/{job}/clear-claim"))))


@jobs_app.command()
def move(
    job: JobArgument,
    server: ServerOption,
    token: TokenOption = None,
    priority: Annotated[int | None, typer.Option(min=-100, max=100, help="Higher priorities come first.")] = None,
    place: Annotated[PlaceOption | None, typer.Option(help="Position among the waiting jobs of its priority.")] = None,
    before: Annotated[str | None, typer.Option(help="A waiting job: go before it, with its priority.")] = None,
) -> None:
    """Change the priority or position of a waiting job."""
    chosen: QueuePosition | None = None if place is None else place.value
    document = {"priority": priority, "place": chosen, "before": before}
    _show(parsed(Job, with_client(server, token, lambda client: client.patch(f"/jobs/{job}", document))))


@jobs_app.command()
def queues(server: ServerOption, token: TokenOption = None, as_json: JsonOption = False) -> None:
    """List the waiting jobs in order, and the state of each vehicle's queue."""
    answer = with_client(server, token, lambda client: client.get("/job-queues"))
    if as_json:
        write_json(answer)
        return
    view = parsed(JobQueuesView, answer)
    if view.waiting:
        out().print(jobs_table(view.waiting))
    out().print(queues_table(view.vehicles))


@jobs_app.command()
def stop(vehicle: VehicleArgument, server: ServerOption, token: TokenOption = None) -> None:
    """Begin and start no more jobs on a vehicle; a run that flies goes on."""
    with_client(server, token, lambda client: client.post(f"/job-queues/{vehicle}/stop"))
    err().print(f"the queue of {vehicle} is stopped", markup=False)


@jobs_app.command()
def resume(vehicle: VehicleArgument, server: ServerOption, token: TokenOption = None) -> None:
    """Go on with a vehicle's queue, after somebody has looked at it."""
    with_client(server, token, lambda client: client.post(f"/job-queues/{vehicle}/resume"))
    err().print(f"the queue of {vehicle} goes on", markup=False)


def _plan(given: str) -> Any:
    """The document of a file, else the ID."""
    is_file = given == "-" or "/" in given or given.endswith(".json") or Path(given).exists()
    return read_plan(Path(given)).model_dump(mode="json") if is_file else given


def _show(job: Job) -> None:
    out().print(jobs_table([job]))
    if job.candidates:
        out().print(candidates_table(job.candidates))
