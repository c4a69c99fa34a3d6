"""The list of runs: filtered, page by page, and as a table that no spreadsheet runs."""

from __future__ import annotations

import csv
import io
from typing import Any

import pytest

from app.api.bodies import JSON, preferred
from app.api.runs import CSV, runs_csv
from app.domain.drop.record import Certainty, DropOutcome, DropRecord
from tests.support.listed_runs import a_run, fill
from tests.support.reasons import some
from tests.support.service_in_process import Service


async def listed(service: Service, query: str) -> list[str]:
    status, _, body = await service.call("GET", f"/api/v1/runs?{query}")
    assert status == 200, body
    return [run["id"] for run in body["runs"]]


async def test_each_filter_and_all_of_them_together(service: Service, plan: dict[str, Any]) -> None:
    plans = await fill(service, plan)
    assert await listed(service, "") == ["run-4", "run-3", "run-2", "run-1", "run-0"]
    assert await listed(service, "state=completed") == ["run-4", "run-0"]
    assert await listed(service, "state=flying,at_drop") == ["run-3", "run-1"]
    assert await listed(service, "open=true") == ["run-3", "run-1"]
    assert await listed(service, "vehicle=v1") == ["run-4", "run-2", "run-0"]
    assert await listed(service, f"plan={plans[1]}") == ["run-3", "run-1"]
    assert await listed(service, "created_from=1001&created_before=1003") == ["run-2", "run-1"]
    assert await listed(service, "created_from=1970-01-01T00:16:43Z") == ["run-4", "run-3"]
    assert await listed(service, f"plan={plans[0]}&vehicle=v1&state=completed&created_from=1001") == ["run-4"]
    assert await listed(service, "state=lost") == []


async def test_pages_follow_each_other_without_gap_or_repetition_while_runs_are_added(
    service: Service, plan: dict[str, Any]
) -> None:
    plans = await fill(service, plan, 7)
    seen: list[str] = []
    query = "limit=2"
    while True:
        _, _, body = await service.call("GET", f"/api/v1/runs?{query}")
        seen += [run["id"] for run in body["runs"]]
        await service.storage.events.append([], [a_run(100 + len(seen), plans[0])])
        if body["next"] is None:
            break
        query = f"limit=2&older_than={body['next']}"
    assert seen == [f"run-{number}" for number in range(6, -1, -1)]


@pytest.mark.parametrize("query", ["state=landing", "state=", "created_from=noon", "created_from=2026-01-01T00:00:00"])
async def test_a_filter_that_cannot_be_used_is_refused(service: Service, query: str) -> None:
    status, _, problem = await service.call("GET", f"/api/v1/runs?{query}")
    assert (status, problem["code"]) == (400, "request.query_invalid")


async def test_a_page_behind_a_run_that_is_none_is_404(service: Service) -> None:
    status, _, problem = await service.call("GET", "/api/v1/runs?older_than=run-x")
    assert (status, problem["code"]) == (404, "resource.not_found")


async def test_csv_has_the_same_runs_and_leads_to_the_next_page(service: Service, plan: dict[str, Any]) -> None:
    await fill(service, plan)
    headers = {"Accept": "text/csv"}
    status, answered, text = await service.call("GET", "/api/v1/runs?limit=3&vehicle=v1", headers=headers)
    assert (status, answered["Content-Type"], answered["Vary"]) == (200, "text/csv; charset=utf-8", "Accept")
    rows = list(csv.DictReader(io.StringIO(text)))
    assert [row["run"] for row in rows] == ["run-4", "run-2", "run-0"]
    assert rows[0]["created"] == "1970-01-01T00:16:44Z"
    assert "Link" not in answered
    _, answered, _ = await service.call("GET", "/api/v1/runs?limit=2&vehicle=v1", headers=headers)
    following = answered["Link"].removeprefix("<").removesuffix('>; rel="next"')
    _, _, text = await service.call("GET", following, headers=headers)
    assert [row["run"] for row in csv.DictReader(io.StringIO(text))] == ["run-0"]


@pytest.mark.parametrize(
    "typed", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "\n=1", '=HYPERLINK("http://x","y")']
)
def test_no_cell_is_a_formula_whatever_was_typed(typed: str) -> None:
    drop = DropRecord(
        plan_item_id=typed, supervised=True, outcome=DropOutcome.RELEASED, certainty=Certainty.ACKNOWLEDGED
    )
    run = a_run(0, reason=some(typed), requested_by=typed, vehicle_id=typed, drops=(drop,))
    rows = list(csv.DictReader(io.StringIO(runs_csv([run]), newline="")))
    assert len(rows) == 1
    assert rows[0]["reason"] == rows[0]["requested_by"] == rows[0]["vehicle"] == f"'{typed}"
    assert rows[0]["outcomes"].startswith(f"'{typed}: released")
    assert (rows[0]["drops"], rows[0]["released"]) == ("1", "1")


@pytest.mark.parametrize(
    ("accept", "is_csv"),
    [
        ([], False),
        (["*/*"], False),
        (["application/json"], False),
        (["text/csv"], True),
        (["TEXT/CSV; header=present"], True),
        (["text/csv;q=0.5, application/json"], False),
        (["application/json;q=0.1", "text/csv;q=0.2"], True),
        (["text/csv;q=0"], False),
        (["text/csv;q=x"], False),
        (["text/html, */*"], False),
    ],
)
def test_csv_is_for_those_who_ask_for_it(accept: list[str], is_csv: bool) -> None:
    assert (preferred(accept, JSON, CSV) == CSV) is is_csv
