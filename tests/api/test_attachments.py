"""Attachments over REST: they are in the delivery report, come back as they were, and cannot be altered unnoticed."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import pytest

from app.domain.run.attachment import MAX_PER_DROP
from app.services.access import Role
from app.storage import verify_journal
from app.storage.attachments import attachments_folder, file_path
from tests.support.service_in_process import Service, run_service
from tests.support.uploads import JPEG, a_run, attach, path_of

PNG = bytes.fromhex(
    "89504e470d0a1a0a0000000d4948445200000001000000010802000000907753de0000000c49444154"
    "08d763f8cfc000000301010018dd8db00000000049454e44ae426082"
)
PDF = b"%PDF-1.7 a receipt"
ENDINGS = {"image/png": ".png", "image/jpeg": ".jpg", "application/pdf": ".pdf"}
TYPES = {"image/png": PNG, "image/jpeg": JPEG, "application/pdf": PDF}


@pytest.mark.parametrize("media", TYPES)
async def test_a_file_comes_back_as_a_download_that_no_browser_interprets(
    service: Service, plan: dict[str, Any], media: str
) -> None:
    run_id = await a_run(service, plan)
    status, headers, made = await attach(service, run_id, TYPES[media], media, "T%C3%BCr%22%20.html")
    assert (status, made["name"], made["actor"]) == (201, f'Tür" .html{ENDINGS[media]}', "local")
    assert (made["sha256"], made["size_bytes"]) == (hashlib.sha256(TYPES[media]).hexdigest(), len(TYPES[media]))
    async with service.http.get(service.url + headers["Location"]) as answer:
        assert (answer.status, await answer.read(), answer.content_type) == (200, TYPES[media], media)
        disposition = answer.headers["Content-Disposition"]
        assert disposition.startswith(f'attachment; filename="T_r__.html{ENDINGS[media]}"; filename*=UTF-8')
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert answer.headers["Content-Security-Policy"].startswith("default-src 'none'")


@pytest.mark.parametrize("media", TYPES)
async def test_a_generated_client_sends_and_gets_plain_bytes(
    service: Service, plan: dict[str, Any], media: str
) -> None:
    run_id = await a_run(service, plan)
    status, headers, made = await attach(service, run_id, TYPES[media], "application/octet-stream")
    assert (status, made["media_type"]) == (201, media)
    asked = {"Accept": "application/octet-stream"}
    async with service.http.get(service.url + headers["Location"], headers=asked) as answer:
        assert (answer.status, await answer.read()) == (200, TYPES[media])
        assert (answer.content_type, answer.headers["Vary"]) == ("application/octet-stream", "Accept")


async def test_the_delivery_report_lists_it_with_its_event_and_the_sheet_shows_small_pictures_alone(
    service: Service, plan: dict[str, Any]
) -> None:
    run_id = await a_run(service, plan)
    large = JPEG + b"x" * 400_000
    for name, content, media in (
        ("small", PNG, "image/png"),
        ("large", large, "image/jpeg"),
        ("bill", PDF, "application/pdf"),
    ):
        assert (await attach(service, run_id, content, media, f"{name}%3Cb%3E"))[0] == 201
    _, _, report = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report")
    assert [(one["name"], one["is_as_attached"]) for one in report["attachments"]] == [
        *(("small<b>.png", True), ("large<b>.jpg", True), ("bill<b>.pdf", True)),
    ]
    entries = [entry for entry in report["entries"] if entry["kind"] == "run.attachment"]
    assert [entry["data"]["sha256"] for entry in entries] == [one["sha256"] for one in report["attachments"]]
    _, headers, sheet = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report.html")
    assert sheet.count("<img") == sheet.count('src="data:image/png;base64,') == 1
    assert "img-src data:" in headers["Content-Security-Policy"]
    assert "<b>" not in sheet.replace("<b>run.", "")
    assert all(one["sha256"] in sheet for one in report["attachments"])


async def test_a_file_that_was_altered_on_the_disk_is_noticed_everywhere(tmp_path: Path, plan: dict[str, Any]) -> None:
    async with run_service(tmp_path) as service:
        run_id = await a_run(service, plan)
        _, headers, made = await attach(service, run_id, PNG, "image/png")
        file_path(attachments_folder(tmp_path / "waydrop.db"), made["sha256"]).write_bytes(PNG + b"!")
        status, _, problem = await service.call("GET", headers["Location"])
        assert (status, problem["code"]) == (410, "attachment.altered")
        _, _, report = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report")
        assert [one["is_as_attached"] for one in report["attachments"]] == [False]
        _, _, sheet = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report.html")
        assert "differs from the file that was attached" in sheet
        assert "<img" not in sheet
        assert len((await verify_journal(tmp_path / "waydrop.db")).alterations) == 1


async def test_the_same_file_is_attached_to_a_drop_once(service: Service, plan: dict[str, Any]) -> None:
    run_id = await a_run(service, plan)
    first = await attach(service, run_id, PNG, "image/png", "first")
    again = await attach(service, run_id, PNG, "image/png", "again")
    assert (first[0], again[0], again[2]) == (201, 200, first[2])
    _, _, listed = await service.call("GET", path_of(run_id))
    assert listed == {"attachments": [first[2]]}


@pytest.mark.parametrize(
    ("content", "media", "status", "code"),
    [
        (b"<html><script>alert(1)</script>", "image/png", 422, "input.invalid"),
        (PNG, "image/jpeg", 422, "input.invalid"),
        (b"<html><script>alert(1)</script>", "application/octet-stream", 422, "input.invalid"),
        (PNG, "text/html", 415, "request.content_type"),
        (b"<svg/>", "image/svg+xml", 415, "request.content_type"),
        (b"", "image/png", 400, "request.malformed"),
    ],
)
async def test_what_is_not_what_it_says_is_refused(
    service: Service, plan: dict[str, Any], content: bytes, media: str, status: int, code: str
) -> None:
    run_id = await a_run(service, plan)
    answer = await attach(service, run_id, content, media)
    assert (answer[0], answer[2]["code"]) == (status, code)
    assert (await service.call("GET", path_of(run_id)))[2] == {"attachments": []}


@pytest.mark.parametrize("name", ["..", "/", "%20", "a%0Ab", "..%2F..%2F"])
async def test_a_name_that_is_none_is_refused(service: Service, plan: dict[str, Any], name: str) -> None:
    run_id = await a_run(service, plan)
    status, _, problem = await attach(service, run_id, PNG, "image/png", name)
    assert (status, problem["code"]) == (422, "input.invalid")


async def test_folders_in_a_name_are_left_out(service: Service, plan: dict[str, Any]) -> None:
    run_id = await a_run(service, plan)
    _, _, made = await attach(service, run_id, PNG, "image/png", "C:%5Cphotos%5C..%2Fdoor.png")
    assert made["name"] == "door.png"


async def test_an_unknown_run_drop_or_file_is_404(service: Service, plan: dict[str, Any]) -> None:
    run_id = await a_run(service, plan)
    for path in (path_of("no"), path_of(run_id, "clinic"), f"{path_of(run_id)}/{'ab' * 32}", f"{path_of(run_id)}/x"):
        status, _, problem = await service.call("GET", path)
        assert (status, problem["code"]) == (404, "resource.not_found")
    status, _, problem = await service.call(
        "POST", path_of(run_id, "clinic") + "?name=x", data=PNG, headers={"Content-Type": "image/png"}
    )
    assert (status, problem["code"]) == (404, "resource.not_found")


async def test_a_drop_takes_only_so_many(service: Service, plan: dict[str, Any]) -> None:
    run_id = await a_run(service, plan)
    for number in range(MAX_PER_DROP):
        assert (await attach(service, run_id, PNG + bytes([number]), "image/png"))[0] == 201
    status, _, problem = await attach(service, run_id, PDF, "application/pdf")
    assert (status, problem["code"]) == (409, "state.conflict")


async def test_a_viewer_reads_and_a_dispatcher_attaches(tmp_path: Path, plan: dict[str, Any]) -> None:
    async with run_service(tmp_path) as service:
        run_id = await a_run(service, plan)
        viewer, dispatcher = await service.token(Role.VIEWER), await service.token(Role.DISPATCHER)
        assert (await attach(service, run_id, PNG, "image/png", **viewer))[0] == 403
        status, headers, made = await attach(service, run_id, PNG, "image/png", **dispatcher)
        assert (status, made["actor"]) == (201, "a dispatcher")
        async with service.http.get(service.url + headers["Location"], headers=viewer) as answer:
            assert answer.status == 200


async def test_when_the_quota_is_used_up_no_more_files_are_taken(tmp_path: Path, plan: dict[str, Any]) -> None:
    async with run_service(tmp_path, attachments_max_bytes=len(PNG) + len(PDF)) as service:
        run_id = await a_run(service, plan)
        assert (await attach(service, run_id, PNG, "image/png"))[0] == 201
        status, _, problem = await attach(service, run_id, JPEG, "image/jpeg")
        assert (status, problem["code"]) == (507, "attachment.quota_exceeded")
        assert "WAYDROP_ATTACHMENTS_MAX_BYTES" in problem["hint"]
        assert (await attach(service, run_id, PDF, "application/pdf"))[0] == 201, "a smaller one still fits"


@pytest.mark.parametrize(
    ("query", "media", "expected"),
    [
        ("name=signature.png", "image/png", (422, False)),
        ("name=front.png", "application/octet-stream", (422, False)),
        ("name=front%2Epng", "image/png", (201, True)),
    ],
    ids=["another name", "another content type", "the same"],
)
async def test_the_same_key_with_another_name_or_content_type_is_refused(
    service: Service, plan: dict[str, Any], query: str, media: str, expected: tuple[int, bool]
) -> None:
    path, key = path_of(await a_run(service, plan)), {"Idempotency-Key": "front-2041"}
    first = {"Content-Type": "image/png", **key}
    assert (await service.call("POST", f"{path}?name=front.png", data=PNG, headers=first))[0] == 201
    repeated = {"Content-Type": media, **key}
    status, headers, body = await service.call("POST", f"{path}?{query}", data=PNG, headers=repeated)
    assert (status, "Idempotency-Replayed" in headers) == expected
    assert body.get("code") == (None if status == 201 else "idempotency.key_reused")
