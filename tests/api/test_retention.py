"""Who asks for what was deleted by age is told so."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from app.domain.events.service import JournalPruned, PrunedChain
from app.domain.events.vehicle import VehicleStatusText
from app.services.retention import Retention, RetentionPeriods
from app.storage import verify_journal
from tests.support.fakes import ManualClock
from tests.support.listener import listen
from tests.support.runs_api import reaches
from tests.support.service_in_process import Service, run_service
from tests.support.uploads import JPEG, a_run, attach

FAR_IN_FUTURE_S = 4e9


async def prune(service: Service, *, days: int | None = None, attachments: int | None = None) -> None:
    """A round of retention, far in the future."""
    await Retention(
        service.storage.retention,
        service.services.journal,
        ManualClock(FAR_IN_FUTURE_S),
        RetentionPeriods.of_days(days, attachments),
        plans_in_use=lambda: (),
    ).prune()


async def record(service: Service, count: int) -> int:
    journal = service.services.journal
    await journal.record(
        *(journal.new_event(VehicleStatusText(severity="info", text=str(n)), vehicle_id="v1") for n in range(count))
    )
    return journal.last_seq


async def test_events_begin_at_the_oldest_that_is_kept_and_older_ones_are_gone(tmp_path: Path) -> None:
    async with run_service(tmp_path) as service:
        deleted = await record(service, 5)
        await prune(service, days=1)
        newest = await record(service, 3)
        _, _, page = await service.call("GET", "/api/v1/events")
        assert [event["seq"] for event in page["events"]] == list(range(deleted + 1, newest + 1))
        assert (page["first_seq"], page["last_seq"]) == (deleted + 1, newest)
        assert page["events"][0]["kind"] == "journal.pruned"
        status, _, page = await service.call("GET", f"/api/v1/events?after={deleted}")
        assert (status, len(page["events"])) == (200, newest - deleted)
        status, _, problem = await service.call("GET", f"/api/v1/events?after={deleted - 1}")
        assert (status, problem["code"], problem["first_seq"]) == (410, "events.pruned", deleted + 1)


async def test_a_client_of_the_stream_is_closed_with_4411_instead_of_missing_events(tmp_path: Path) -> None:
    async with run_service(tmp_path) as service:
        deleted = await record(service, 5)
        await prune(service, days=1)
        async with listen(service, f"?after={deleted - 1}") as client:
            hello = await client.frame("hello")
            assert (hello["first_seq"], await client.close_code()) == (deleted + 1, 4411)
        async with listen(service, "?after=0") as client:
            assert (await client.frame("event"))["event"]["seq"] == deleted + 1


async def test_a_webhook_cannot_begin_with_a_deleted_event(tmp_path: Path) -> None:
    async with run_service(tmp_path) as service:
        deleted = await record(service, 5)
        await prune(service, days=1)
        order = {"url": "https://receiver.example/", "after": deleted - 1}
        status, _, problem = await service.call("POST", "/api/v1/webhooks", json=order)
        assert (status, problem["code"]) == (410, "events.pruned")
        status, _, made = await service.call("POST", "/api/v1/webhooks", json=order | {"after": 0})
        assert status == 201
        assert made["events_behind"] <= service.services.journal.last_seq - deleted


async def test_an_old_file_is_gone_and_nobody_calls_that_an_alteration(tmp_path: Path, plan: dict[str, Any]) -> None:
    async with run_service(tmp_path) as service:
        run_id = await a_run(service, plan)
        _, headers, _ = await attach(service, run_id, JPEG, "image/jpeg")
        await prune(service, attachments=1)
        status, _, problem = await service.call("GET", headers["Location"])
        assert (status, problem["code"]) == (410, "attachment.expired")
        _, _, report = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report")
        assert [(one["is_as_attached"], one["is_expired"]) for one in report["attachments"]] == [(False, True)]
        _, _, sheet = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report.html")
        assert "deleted at the end of its retention period" in sheet
        assert "WARNING: the stored file" not in sheet
        assert (await verify_journal(tmp_path / "waydrop.db")).alterations == []


async def test_a_delivery_report_says_that_the_beginning_of_the_run_was_deleted(
    tmp_path: Path, plan: dict[str, Any]
) -> None:
    async with run_service(tmp_path) as service:
        run_id = await a_run(service, plan)
        await service.call("POST", f"/api/v1/runs/{run_id}/abort")
        await reaches(service, run_id, "aborted")
        report, journal = f"/api/v1/runs/{run_id}/delivery-report", service.services.journal
        _, _, whole = await service.call("GET", report)
        assert whole["is_whole"]
        first, *_ = await journal.read(0, 1, run_id=run_id)
        chain = PrunedChain(gateway=first.gateway, seq=first.seq, hash=first.hash)
        pruned = JournalPruned(up_to=first.seq, chains=(chain,), before=first.time, attachments_before=None)
        await journal.record(journal.new_event(pruned))
        await service.storage.retention.prune(pruned)
        _, _, cut = await service.call("GET", report)
        assert (cut["is_whole"], cut["is_final"]) == (False, True)
        _, _, sheet = await service.call("GET", f"{report}.html")
        assert "first entries of this run were deleted" in sheet


async def test_a_file_that_is_attached_again_is_there_again(tmp_path: Path, plan: dict[str, Any]) -> None:
    async with run_service(tmp_path) as service:
        run_id = await a_run(service, plan)
        await attach(service, run_id, JPEG, "image/jpeg")
        await prune(service, attachments=1)
        status, headers, _ = await attach(service, run_id, JPEG, "image/jpeg")
        assert status == 200
        async with service.http.get(service.url + headers["Location"]) as answer:
            assert (answer.status, await answer.read()) == (200, JPEG)
