"""/runs: flights of plans, and commands to them."""

from __future__ import annotations

import csv
import io
from collections.abc import Awaitable, Callable, Sequence
from datetime import UTC, datetime
from typing import Annotated, Final

from aiohttp import web
from pydantic import BaseModel, Field

from app.api.bodies import JSON, Empty, asked_of, json_answer
from app.api.models import EventsQuery, EventsView, Identifier, ListQuery, RunRequest, Time, only_states_of
from app.api.routing import NEW_WORK, STORED, VEHICLE, Answer, Call, NoQuery, Routes
from app.api.run_changes import ACCEPTED, accepted
from app.domain.ports.stores import RunFilter
from app.domain.prediction import CALM
from app.domain.reasons import describe
from app.domain.run.run import Run, RunState
from app.services.access import Role
from app.services.journal import first_seq

ROUTES: Final = Routes("runs")

CSV: Final = "text/csv"
_FORMULA: Final = ("=", "+", "-", "@", "\t", "\r", "\n")
"""Spreadsheets treat cells with these prefixes as formulas. Names are user input."""

_States = Annotated[
    str, only_states_of(RunState), Field(description="comma-separated states, for example flying,at_drop")
]


class RunsQuery(ListQuery):
    """Filters for runs. `open`: only unfinished runs. `older_than`: the page after this run, taken from `next`."""

    vehicle: Identifier | None = None
    plan: Identifier | None = None
    state: _States | None = None
    open: bool = False
    created_from: Time | None = None
    created_before: Time | None = None
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


_PAGED = ("Link", "Content-Disposition")
_ACTION_ERRORS = (*STORED, *VEHICLE, "state.conflict", "run.wrong_state", "run.not_followed", "vehicle.taken")
_MODE_ERRORS = (*_ACTION_ERRORS, "vehicle.in_failsafe")


@ROUTES.route(
    "POST",
    "/runs",
    Role.DISPATCHER,
    ACCEPTED,
    errors=(*STORED, *VEHICLE, *NEW_WORK, "state.conflict", "vehicle.busy", "vehicle.taken", "plan.rejected"),
)
async def create_run(call: Call[NoQuery, RunRequest]) -> web.Response:
    """Create a run: upload a plan to a vehicle and optionally start it."""
    asked = call.body
    wind = CALM if asked.wind is None else asked.wind.wind()
    run = await call.services.runs.create(
        asked.plan,
        asked.vehicle,
        start=asked.start,
        actor=call.principal.name,
        wind=wind,
        answer=call.answered(accepted),
    )
    return accepted(run)


@ROUTES.route(
    "GET",
    "/runs",
    Role.VIEWER,
    Answer(200, "The runs", RunsView),
    Answer(200, "The list as CSV (Accept: text/csv)", media=CSV, schema={"type": "string"}, headers=_PAGED),
    errors=STORED,
)
async def list_runs(call: Call[RunsQuery, Empty]) -> web.Response:
    """List runs, newest first."""
    query = call.query
    found = await call.services.runs.list_runs(query.limit + 1, query.wanted())
    page = list(found[: query.limit])
    older_than = page[-1].id if len(found) > query.limit else None
    if asked_of(call.request, JSON, CSV) == JSON:
        return json_answer(RunsView(runs=page, next=older_than), headers={"Vary": "Accept"})
    headers = {"Vary": "Accept", "Content-Disposition": 'attachment; filename="runs.csv"'}
    if older_than is not None:
        following = call.request.rel_url.update_query({"older_than": older_than})
        headers["Link"] = f'<{following}>; rel="next"'
    return web.Response(text=runs_csv(page), content_type=CSV, charset="utf-8", headers=headers)


@ROUTES.route("GET", "/runs/{run_id}", Role.VIEWER, Answer(200, "The run", Run), errors=STORED)
async def get_run(call: Call[NoQuery, Empty]) -> web.Response:
    """Get a run."""
    return json_answer(await call.services.runs.get(call.path_value("run_id")))


@ROUTES.route("GET", "/runs/{run_id}/events", Role.VIEWER, Answer(200, "A page of events", EventsView), errors=STORED)
async def list_run_events(call: Call[EventsQuery, Empty]) -> web.Response:
    """List the events of a run, in order."""
    run = await call.services.runs.get(call.path_value("run_id"))
    journal = call.services.journal
    events = await journal.read(call.query.after, call.query.limit, run_id=run.id)
    return json_answer(EventsView(events=list(events), first_seq=first_seq(journal), last_seq=journal.last_seq))


@ROUTES.route(
    "POST",
    "/runs/{run_id}/start",
    Role.DISPATCHER,
    ACCEPTED,
    errors=(*_ACTION_ERRORS, *NEW_WORK, "plan.rejected"),
)
async def start_run(call: Call[NoQuery, Empty]) -> web.Response:
    """Start a run: arm and fly the uploaded mission."""
    return await _command(call, call.services.runs.start)


@ROUTES.route("POST", "/runs/{run_id}/pause", Role.PILOT, ACCEPTED, errors=_MODE_ERRORS, is_urgent=True)
async def pause_run(call: Call[NoQuery, Empty]) -> web.Response:
    """Pause a run: the vehicle holds."""
    return await _command(call, call.services.runs.pause)


@ROUTES.route("POST", "/runs/{run_id}/resume", Role.PILOT, ACCEPTED, errors=_MODE_ERRORS)
async def resume_run(call: Call[NoQuery, Empty]) -> web.Response:
    """Resume a paused run."""
    return await _command(call, call.services.runs.resume)


@ROUTES.route("POST", "/runs/{run_id}/return", Role.PILOT, ACCEPTED, errors=_ACTION_ERRORS, is_urgent=True)
async def return_run(call: Call[NoQuery, Empty]) -> web.Response:
    """End the mission and return to launch."""
    return await _command(call, call.services.runs.return_to_launch)


@ROUTES.route(
    "POST",
    "/runs/{run_id}/divert",
    Role.PILOT,
    ACCEPTED,
    errors=(*_ACTION_ERRORS, "run.divert_refused"),
    is_urgent=True,
)
async def divert_run(call: Call[NoQuery, Empty]) -> web.Response:
    """End the mission and divert to a rally point, which `rally` of the run names."""
    return await _command(call, call.services.runs.divert)


@ROUTES.route("POST", "/runs/{run_id}/land", Role.PILOT, ACCEPTED, errors=_ACTION_ERRORS, is_urgent=True)
async def land_run(call: Call[NoQuery, Empty]) -> web.Response:
    """End the mission and land at the current position."""
    return await _command(call, call.services.runs.land)


@ROUTES.route("POST", "/runs/{run_id}/abort", Role.PILOT, ACCEPTED, errors=_ACTION_ERRORS, is_urgent=True)
async def abort_run(call: Call[NoQuery, Empty]) -> web.Response:
    """Abort a run: on the ground at once, in flight by Return mode."""
    return await _command(call, call.services.runs.abort)


async def _command(call: Call[NoQuery, Empty], action: Callable[[str], Awaitable[Run]]) -> web.Response:
    return accepted(await action(call.path_value("run_id")))
