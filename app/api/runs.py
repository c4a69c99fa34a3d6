"""/runs: flights of plans, and commands to them."""

from __future__ import annotations

import csv
import io
from collections.abc import Awaitable, Callable, Sequence
from datetime import UTC, datetime
from typing import Annotated, Final

from aiohttp import web
from pydantic import AwareDatetime, BaseModel, Field

from app.api.bodies import JSON, Empty, asked_of, json_answer, json_body
from app.api.models import EventsQuery, EventsView, Identifier, ListQuery, RunRequest, only_states_of
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route, tagged
from app.api.run_changes import ACCEPTED, accepted
from app.api.services import JOURNAL, RUNS
from app.domain.ports.stores import RunFilter
from app.domain.prediction import CALM
from app.domain.reasons import describe
from app.domain.run.run import Run, RunState
from app.services.access import Role

# The list of runs: filters, and its CSV form.


CSV: Final = "text/csv"
_FORMULA: Final = ("=", "+", "-", "@", "\t", "\r", "\n")
"""Spreadsheets treat cells with these prefixes as formulas. Names are user input."""

_States = Annotated[
    str, only_states_of(RunState), Field(description="comma-separated states, for example flying,at_drop")
]
_Time = Annotated[AwareDatetime, Field(description="ISO 8601 with UTC offset, or Unix seconds")]


class RunsQuery(ListQuery):
    """Filters for runs. `open`: only unfinished runs. `older_than`: the page after this run, taken from `next`."""

    vehicle: Identifier | None = None
    plan: Identifier | None = None
    state: _States | None = None
    open: bool = False
    created_from: _Time | None = None
    created_before: _Time | None = None
    older_than: Identifier | None = None

    def wanted(self) -> RunFilter:
        """Convert to the query of the service."""
        return RunFilter(
            vehicle_id=self.vehicle,
            plan_id=self.plan,
            states=frozenset(RunState(part) for part in self.state.split(",")) if self.state else frozenset(),
            open_only=self.open,
            created_from=None if self.created_from is None else self.created_from.timestamp(),
            created_before=None if self.created_before is None else self.created_before.timestamp(),
            older_than=self.older_than,
        )


class RunsView(BaseModel):
    """Runs, newest first. Pass `next` as `older_than` to get the next page; it is null on the last page."""

    runs: list[Run]
    next: str | None = None


def runs_csv(runs: Sequence[Run]) -> str:
    """One CSV row per run (RFC 4180), times in UTC. Values that look like formulas are prefixed with '."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow(_COLUMNS)
    for run in runs:
        writer.writerow([spreadsheet_cell(value) for value in _row(run)])
    return out.getvalue()


_COLUMNS: Final = (
    *("run", "state", "reason_code", "reason", "plan", "vehicle", "vehicle_type", "requested_by"),
    *("created", "started", "ended", "drops", "released", "outcomes"),
)


def _row(run: Run) -> tuple[object, ...]:
    released = sum(drop.outcome.value == "released" for drop in run.drops)
    outcomes = "; ".join(f"{drop.plan_item_id}: {drop.outcome} ({drop.certainty})" for drop in run.drops)
    return (
        *(
            run.id,
            run.state.value,
            run.reason and run.reason.code.value,
            describe(run.reason),
            run.plan_id,
            run.vehicle_id,
        ),
        *(run.vehicle_type and run.vehicle_type.value, run.requested_by),
        *(_time(run.created_at), _time(run.started_at), _time(run.ended_at)),
        *(sum(drop.alternate_to is None for drop in run.drops), released, outcomes),
    )


def spreadsheet_cell(value: object) -> object:
    """Return a value that no spreadsheet interprets as a formula."""
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value


def _time(seconds: float | None) -> str | None:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


async def create_run(call: Call[NoQuery, RunRequest]) -> web.Response:
    asked = call.body
    wind = CALM if asked.wind is None else asked.wind.wind()
    run = await call.request.app[RUNS].create(
        asked.plan, asked.vehicle, start=asked.start, actor=call.principal.name, wind=wind
    )
    return accepted(run)


async def list_runs(call: Call[RunsQuery, Empty]) -> web.Response:
    query = call.query
    found = await call.request.app[RUNS].list_runs(query.limit + 1, query.wanted())
    page = list(found[: query.limit])
    older_than = page[-1].id if len(found) > query.limit else None
    if asked_of(call.request, JSON, CSV) == JSON:
        return json_answer(RunsView(runs=page, next=older_than), headers={"Vary": "Accept"})
    headers = {"Vary": "Accept", "Content-Disposition": 'attachment; filename="runs.csv"'}
    if older_than is not None:
        following = call.request.rel_url.update_query({"older_than": older_than})
        headers["Link"] = f'<{following}>; rel="next"'
    return web.Response(text=runs_csv(page), content_type=CSV, charset="utf-8", headers=headers)


async def get_run(call: Call[NoQuery, Empty]) -> web.Response:
    return json_answer(await call.request.app[RUNS].get(call.path_value("run_id")))


async def list_run_events(call: Call[EventsQuery, Empty]) -> web.Response:
    run = await call.request.app[RUNS].get(call.path_value("run_id"))
    journal = call.request.app[JOURNAL]
    events = await journal.read(call.query.after, call.query.limit, run_id=run.id)
    return json_answer(EventsView(events=list(events), last_seq=journal.last_seq))


async def start_run(call: Call[NoQuery, Empty]) -> web.Response:
    return await _command(call, call.request.app[RUNS].start)


async def pause_run(call: Call[NoQuery, Empty]) -> web.Response:
    return await _command(call, call.request.app[RUNS].pause)


async def resume_run(call: Call[NoQuery, Empty]) -> web.Response:
    return await _command(call, call.request.app[RUNS].resume)


async def return_run(call: Call[NoQuery, Empty]) -> web.Response:
    return await _command(call, call.request.app[RUNS].return_to_launch)


async def divert_run(call: Call[NoQuery, Empty]) -> web.Response:
    return await _command(call, call.request.app[RUNS].divert)


async def land_run(call: Call[NoQuery, Empty]) -> web.Response:
    return await _command(call, call.request.app[RUNS].land)


async def abort_run(call: Call[NoQuery, Empty]) -> web.Response:
    return await _command(call, call.request.app[RUNS].abort)


async def _command(call: Call[NoQuery, Empty], action: Callable[[str, str], Awaitable[Run]]) -> web.Response:
    return accepted(await action(call.path_value("run_id"), call.principal.name))


_PAGED = ("Link", "Content-Disposition")
_ACTION_ERRORS = (
    "resource.not_found",
    "state.conflict",
    "run.wrong_state",
    "vehicle.quarantined",
    "vehicle.refused",
    "vehicle.link",
    "vehicle.timeout",
    "storage.failed",
)
_MORE_ERRORS = {"start": ("plan.rejected", "vehicle.taken"), "divert": ("run.divert_refused",)}

ROUTES: tuple[AnyRoute, ...] = tagged(
    "runs",
    Route(
        method="POST",
        path=f"{API}/runs",
        handler=create_run,
        summary="Create a run: upload a plan to a vehicle and optionally start it",
        role=Role.DISPATCHER,
        body=json_body(RunRequest),
        answers=(ACCEPTED,),
        errors=(
            *("resource.not_found", "state.conflict", "vehicle.busy", "vehicle.taken", "vehicle.quarantined"),
            *("plan.rejected", "vehicle.link", "vehicle.timeout", "vehicle.refused", "storage.failed"),
        ),
        idempotent=True,
    ),
    Route(
        method="GET",
        path=f"{API}/runs",
        handler=list_runs,
        summary="List runs, newest first",
        role=Role.VIEWER,
        query=RunsQuery,
        answers=(
            Answer(200, "The runs", RunsView),
            Answer(200, "The list as CSV (Accept: text/csv)", media=CSV, schema={"type": "string"}, headers=_PAGED),
        ),
        errors=("resource.not_found", "storage.failed"),
    ),
    Route(
        method="GET",
        path=f"{API}/runs/{{run_id}}",
        handler=get_run,
        summary="Get a run",
        role=Role.VIEWER,
        answers=(Answer(200, "The run", Run),),
        errors=("resource.not_found", "storage.failed"),
    ),
    Route(
        method="GET",
        path=f"{API}/runs/{{run_id}}/events",
        handler=list_run_events,
        summary="List the events of a run, in order",
        role=Role.VIEWER,
        query=EventsQuery,
        answers=(Answer(200, "A page of events", EventsView),),
        errors=("resource.not_found", "storage.failed"),
    ),
    *(
        Route(
            method="POST",
            path=f"{API}/runs/{{run_id}}/{action}",
            handler=handler,
            summary=summary,
            role=role,
            answers=(ACCEPTED,),
            errors=(*_ACTION_ERRORS, *_MORE_ERRORS.get(action, ())),
        )
        for action, handler, role, summary in (
            ("start", start_run, Role.DISPATCHER, "Start a run: arm and fly the uploaded mission"),
            ("pause", pause_run, Role.PILOT, "Pause a run: the vehicle holds"),
            ("resume", resume_run, Role.PILOT, "Resume a paused run"),
            ("return", return_run, Role.PILOT, "End the mission and return to launch"),
            (
                "divert",
                divert_run,
                Role.PILOT,
                "End the mission and divert to a rally point, which `rally` of the run names",
            ),
            ("land", land_run, Role.PILOT, "End the mission and land at the current position"),
            ("abort", abort_run, Role.PILOT, "Abort a run: on the ground at once, in flight by Return mode"),
        )
    ),
)
