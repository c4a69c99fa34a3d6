"""`waydrop jobs` against a real service."""

from __future__ import annotations

import json
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from structlog.testing import capture_logs
from typer.testing import Result

from app.cli.terminal import ServerRefusedError
from app.domain.errors import InvalidInputError
from app.domain.jobs.job import Job
from tests.support.dispatch_commands import waydrop
from tests.support.job_plans import ROUTE, queue, until_job
from tests.support.service_in_process import Service


@pytest.fixture(autouse=True)
def _quiet_service() -> Iterator[None]:
    """The service's log would go where the command writes: here they are one process."""
    with capture_logs():
        yield


def refusal(result: Result) -> str:
    """The code with which the service refused."""
    assert isinstance(result.exception, ServerRefusedError)
    return result.exception.code


@pytest.mark.parametrize("option", ["--not-before", "--deadline"])
async def test_a_time_that_is_none_is_told_as_the_option_that_it_is(service: Service, option: str) -> None:
    refused = await waydrop(service, "jobs", "add", "plan-1", option, "tomorrow")
    assert refused.exit_code == 2
    assert f"Invalid value for '{option}'" in " ".join(refused.stderr.split())


async def test_a_plan_is_checked_queued_moved_shown_and_cancelled(service: Service, tmp_path: Path) -> None:
    file = tmp_path / "route.json"
    file.write_text(json.dumps(ROUTE))
    service.links[0].move(battery_percent=5.0)
    checked = await waydrop(service, "jobs", "add", str(file), "--check")
    assert (checked.exit_code, "vehicle.battery_low: its battery has 5 %" in checked.stdout) == (0, True)
    none = await waydrop(service, "jobs", "add", str(file), "--check", "--allow", "v1")
    assert (none.exit_code, "no vehicle is available now" in none.stderr) == (1, True)
    added = await waydrop(service, "jobs", "add", str(file), "--json", "--priority", "2", "--vehicle", "v1")
    job = json.loads(added.stdout)
    assert (job["state"], job["priority"], job["auto_start"]) == ("queued", 2, False)
    moved = await waydrop(service, "jobs", "move", job["id"], "--priority", "7", "--place", "first")
    assert (moved.exit_code, job["id"] in moved.stdout, " 7 " in moved.stdout) == (0, True, True)
    next_job = json.loads((await waydrop(service, "jobs", "add", str(file), "--json", "--vehicle", "v1")).stdout)
    ahead = await waydrop(service, "jobs", "move", next_job["id"], "--before", job["id"])
    assert (ahead.exit_code, " 7 " in ahead.stdout) == (0, True)
    await waydrop(service, "jobs", "cancel", next_job["id"])
    shown = await waydrop(service, "jobs", "show", job["id"])
    assert "vehicle.battery_low" in shown.stdout
    by_id = await waydrop(service, "jobs", "add", job["plan_id"], "--vehicle", "v2", "--json")
    await until_job(service, json.loads(by_id.stdout)["id"], "prepared")
    listed = await waydrop(service, "jobs", "list", "--open", "--state", "queued", "--json")
    assert [one["id"] for one in json.loads(listed.stdout)["jobs"]] == [job["id"]]
    cancelled = await waydrop(service, "jobs", "cancel", job["id"])
    assert "cancelled by local" in cancelled.stdout
    again = await waydrop(service, "jobs", "cancel", job["id"])
    assert (refusal(again), again.stdout) == ("job.wrong_state", "")
    assert "no such jobs" in (await waydrop(service, "jobs", "list", "--state", "expired")).stderr


async def test_a_plan_file_that_is_not_there_is_no_plan_of_the_service(service: Service, tmp_path: Path) -> None:
    missing = await waydrop(service, "jobs", "add", str(tmp_path / "rnu.json"))
    assert isinstance(missing.exception, InvalidInputError)
    assert "No such file" in missing.exception.detail


async def test_queues_are_shown_stopped_and_resumed(service: Service) -> None:
    assert (await waydrop(service, "jobs", "stop", "v1")).exit_code == 0
    shown = await waydrop(service, "jobs", "queues")
    assert "its queue is stopped: stopped by local" in shown.stdout
    assert (await waydrop(service, "jobs", "resume", "v1")).exit_code == 0
    queues = json.loads((await waydrop(service, "jobs", "queues", "--json")).stdout)
    assert [view["ready"] for view in queues["vehicles"]] == [True, True]
    assert refusal(await waydrop(service, "jobs", "resume", "v9")) == "resource.not_found"


async def test_a_time_that_has_no_date_here_is_shown_all_the_same(service: Service) -> None:
    """An older version has stored it."""
    job = await queue(service, vehicle="v1", not_before=(datetime.now(UTC) + timedelta(days=1)).isoformat())
    stored = Job.model_validate(job).model_copy(update={"deadline": 253_402_343_999.0})
    await service.storage.events.append([], jobs=[stored])
    listed = await waydrop(service, "jobs", "list", "--json")
    assert json.loads(listed.stdout)["jobs"][0]["deadline"] == stored.deadline
    shown = await waydrop(service, "jobs", "list")
    assert (shown.exit_code, "after 1970" in " ".join(shown.stdout.split())) == (0, True)
