"""`waydrop runs list` and `waydrop webhook` against a real service."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from typing import Any

import pytest
from structlog.testing import capture_logs

from app.cli import runs
from tests.support.deliveries import DELIVERED, a_plan, deliver
from tests.support.dispatch_commands import waydrop
from tests.support.listed_runs import a_run, fill
from tests.support.reasons import some
from tests.support.service_in_process import Service
from tests.support.webhook_receiver import Receiver


@pytest.fixture(autouse=True)
def _quiet_service() -> Iterator[None]:
    """The service's log would go where the command writes: here they are one process."""
    with capture_logs():
        yield


async def test_runs_are_listed_by_the_filters_of_the_service(service: Service, plan: dict[str, Any]) -> None:
    plans = await fill(service, plan)
    filters = ("--state", "completed", "--vehicle", "v1", "--plan", plans[0], "--since", "1001", "--until", "1005")
    listed = await waydrop(service, "runs", "list", *filters, "--json")
    assert [run["id"] for run in json.loads(listed.stdout)["runs"]] == ["run-4"]
    shown = await waydrop(service, "runs", "list", "--open")
    assert [line.split()[1] for line in shown.stdout.splitlines() if " run-" in line] == ["run-3", "run-1"]
    none = await waydrop(service, "runs", "list", "--state", "lost")
    assert (none.exit_code, none.stdout, "no such runs" in none.stderr) == (0, "", True)


@pytest.mark.parametrize("command", ["runs list --since", "runs list --until", "audit --since", "audit --until"])
async def test_a_time_that_is_none_is_told_as_the_option_that_it_is(service: Service, command: str) -> None:
    refused = await waydrop(service, *command.split(), "2026-05-01T08:00:00")
    assert refused.exit_code == 2
    said = " ".join(refused.stderr.replace("\u2502", " ").split())  # in a frame
    assert f"Invalid value for '{command.split()[-1]}'" in said
    assert "not a valid time with a UTC offset" in said
    assert "query parameter" not in said


async def test_a_long_list_is_fetched_page_by_page_and_csv_has_one_heading(
    service: Service, plan: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runs, "PAGE", 3)
    plan_id = await a_plan(service, plan)
    listed = [a_run(number, plan_id, reason=some('two\r\nlines, "quoted"')) for number in range(8)]
    await service.storage.events.append([], listed)
    expected = [f"run-{number}" for number in range(7, 0, -1)]
    table = await waydrop(service, "runs", "list", "--csv", "--limit", "7")
    rows = list(csv.DictReader(io.StringIO(table.stdout_bytes.decode(), newline="")))
    assert [row["run"] for row in rows] == expected
    assert {row["reason"] for row in rows} == {'two\r\nlines, "quoted"'}
    listed = await waydrop(service, "runs", "list", "--json", "--limit", "7")
    assert [run["id"] for run in json.loads(listed.stdout)["runs"]] == expected


async def test_a_webhook_is_made_tested_disabled_enabled_and_deleted(service: Service, plan: dict[str, Any]) -> None:
    plan_id = await a_plan(service, plan)
    async with Receiver().serving() as receiver:
        made = await waydrop(service, "webhook", "create", receiver.url, "--description", "desk")
        secret, hook_id = made.stdout.strip(), made.stderr.split()[1]
        assert (await waydrop(service, "webhook", "test", hook_id)).exit_code == 0
        assert receiver.taken[0].is_signed_with(secret)
        receiver.usual = 500
        refused = await waydrop(service, "webhook", "test", hook_id)
        assert (refused.exit_code, "HTTP 500" in refused.stderr) == (1, True)
        await waydrop(service, "webhook", "disable", hook_id)
        listed = await waydrop(service, "webhook", "list")
        assert hook_id in listed.stdout
        assert "disabled by local" in listed.stdout
        assert secret not in listed.stdout
        receiver.usual = 200
        await deliver(service.services.journal, plan_id, "run-1")
        await waydrop(service, "webhook", "enable", hook_id)
        await receiver.until(lambda: receiver.types()[1:] == DELIVERED)
        assert (await waydrop(service, "webhook", "delete", hook_id)).exit_code == 0
        assert "no webhooks" in (await waydrop(service, "webhook", "list")).stderr
