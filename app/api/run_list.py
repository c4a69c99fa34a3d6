"""The list of runs: what can be asked of it, and its form as a table for spreadsheets."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Annotated, Final

from pydantic import AwareDatetime, BaseModel, Field

from app.api.models import Identifier, ListQuery
from app.api.state_list import only_states_of
from app.domain.reason import in_words
from app.domain.run import Run, RunState
from app.domain.run_filter import RunFilter

CSV: Final = "text/csv"
_FORMULA: Final = ("=", "+", "-", "@", "\t", "\r", "\n")
"""With these a spreadsheet takes a cell for a formula, and runs what somebody typed as a name."""

_States = Annotated[
    str, only_states_of(RunState), Field(description="any of these states, comma separated: flying,at_drop")
]
_Time = Annotated[AwareDatetime, Field(description="ISO 8601 with its zone, or Unix seconds")]


class RunsQuery(ListQuery):
    """Which runs. `open`: only those that are not over. `older_than`: the page behind this run, as `next` says it."""

    vehicle: Identifier | None = None
    plan: Identifier | None = None
    state: _States | None = None
    open: bool = False
    created_from: _Time | None = None
    created_before: _Time | None = None
    older_than: Identifier | None = None

    def wanted(self) -> RunFilter:
        """The query as services understand it."""
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
    """Runs, newest first. `next` goes into `older_than` for the next page; null behind the last one."""

    runs: list[Run]
    next: str | None = None


def runs_csv(runs: Sequence[Run]) -> str:
    """One line for each run (RFC 4180), times in UTC. What a spreadsheet would take for a formula begins with '."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow(_COLUMNS)
    for run in runs:
        writer.writerow([_cell(value) for value in _row(run)])
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
            in_words(run.reason),
            run.plan_id,
            run.vehicle_id,
        ),
        *(run.vehicle_type and run.vehicle_type.value, run.requested_by),
        *(_time(run.created_at), _time(run.started_at), _time(run.ended_at)),
        *(sum(drop.alternate_to is None for drop in run.drops), released, outcomes),
    )


def _cell(value: object) -> object:
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value


def _time(seconds: float | None) -> str | None:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
