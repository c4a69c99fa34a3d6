"""Delivery report over REST: what it rests on can be found again in the journal."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import pytest

from app.api import delivery_reports as endpoints
from app.domain.delivery.delivery_report import RunHistory
from app.domain.events.run import RunCommand
from app.domain.events.service import SimulatorFault
from app.domain.vehicle.link_security import LinkSecurity
from app.domain.vehicle.state import FlightMode, LandedState
from app.services import delivery_reports as service_reports
from tests.support.runs_api import create, reaches
from tests.support.service_in_process import Service

HOSTILE = '<script>alert(1)</script> & "quotes" \'n <b>tags'


async def proven(service: Service, plan: dict[str, Any]) -> str:
    """A run in flight of a stored plan."""
    _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
    run = await create(service, made["id"], start=True)
    await reaches(service, run["id"], "flying")
    return str(run["id"])


async def test_a_delivery_report_names_order_plan_mission_vehicle_and_every_drop(
    service: Service, plan: dict[str, Any]
) -> None:
    run_id = await proven(service, plan)
    status, _, report = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report")
    _, _, run = await service.call("GET", f"/api/v1/runs/{run_id}")
    assert status == 200
    flown = {"id": run["plan_id"], "hash": run["plan_hash"], "is_as_flown": True}
    assert report["plan"] == {**flown, "name": plan["name"], "order": plan["order"]}
    assert len(report["mission"]["hash"]) == 64
    assert report["vehicle"]["vehicle_type"] == plan["vehicle_type"]
    assert [drop["plan_item_id"] for drop in report["drops"]] == ["drop"]
    assert None not in (report["drops"][0]["planned_latitude_deg"], report["drops"][0]["planned_longitude_deg"])
    assert (report["gateway"], report["requested_by"], report["is_final"]) == (
        service.storage.gateway_id,
        "local",
        False,
    )


@pytest.mark.parametrize("security", LinkSecurity)
async def test_a_delivery_report_says_how_the_vehicles_link_was_protected(
    service: Service, plan: dict[str, Any], security: LinkSecurity
) -> None:
    service.links[0].move(link_security=security)
    run_id = await proven(service, plan)
    service.links[0].move(link_security=LinkSecurity.SIGNED)
    _, _, report = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report")
    _, _, sheet = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report.html")
    assert report["link_security"] == security.value, "the weakest that it was"
    assert f"{security.value}: " in sheet


async def test_a_delivery_report_says_where_the_vehicle_was_heard_last(service: Service, plan: dict[str, Any]) -> None:
    run_id = await proven(service, plan)
    service.links[0].change(landed=LandedState.IN_AIR)
    service.links[0].move(latitude_deg=47.3981, longitude_deg=8.5461, position_age_s=0.1)
    service.links[0].change(mode=FlightMode.LAND, landed=LandedState.ON_GROUND, armed=False)
    run = await reaches(service, run_id, "failed")
    _, _, report = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report")
    _, _, sheet = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report.html")
    assert report["last_position"] == run["last_position"]
    assert (run["last_position"]["latitude_deg"], run["last_position"]["longitude_deg"]) == (47.3981, 8.5461)
    assert "47.3981000, 8.5461000, at " in sheet


async def test_each_entry_is_an_event_of_the_journal_with_its_hash(service: Service, plan: dict[str, Any]) -> None:
    run_id = await proven(service, plan)
    _, _, report = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report")
    _, _, page = await service.call("GET", f"/api/v1/runs/{run_id}/events?limit=500")
    journal = {event["seq"]: event for event in page["events"]}
    assert [entry["seq"] for entry in report["entries"]] == sorted(entry["seq"] for entry in report["entries"])
    for entry in report["entries"]:
        event = journal[entry["seq"]]
        assert (entry["hash"], entry["time"], entry["kind"]) == (event["hash"], event["time"], event["kind"])
        assert entry["data"].items() <= event["data"].items()
    told = {(entry["kind"], entry["data"].get("command")) for entry in report["entries"]}
    assert {("run.command", "arm"), ("run.ack", "arm"), ("run.command", "start_mission")} <= told


async def test_every_state_is_told_once_and_the_rest_of_the_run_is_not(service: Service, plan: dict[str, Any]) -> None:
    run_id = await proven(service, plan)
    _, _, report = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report")
    states = [entry["data"]["state"] for entry in report["entries"] if entry["kind"] in ("run.created", "run.changed")]
    assert states == ["created", "uploading", "uploaded", "starting", "flying"]
    assert all(
        set(entry["data"]) == {"state", "reason"} for entry in report["entries"] if entry["kind"] == "run.changed"
    )


async def test_a_long_story_is_told_whole(service: Service, plan: dict[str, Any]) -> None:
    run_id = await proven(service, plan)
    journal = service.services.journal
    await journal.record(
        *(journal.new_event(RunCommand(command="DO_GRIPPER", attempt=n), run_id=run_id) for n in range(1000, 2200))
    )
    _, _, report = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report")
    numbers = [entry["data"]["attempt"] for entry in report["entries"] if (entry["data"].get("attempt") or 0) >= 1000]
    assert numbers == list(range(1000, 2200))


async def test_the_loop_neither_folds_the_story_nor_draws_the_sheet_and_reads_few_events_at_once(
    service: Service, plan: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    run_id = await proven(service, plan)
    worked: dict[str, set[int]] = {}
    limits: list[int] = []

    def watched(place: Any, name: str) -> None:
        original: Callable[..., Any] = getattr(place, name)

        def watch(*args: Any, **named: Any) -> Any:
            worked.setdefault(name, set()).add(threading.get_ident())
            return original(*args, **named)

        monkeypatch.setattr(place, name, watch)

    watched(RunHistory, "take")
    watched(service_reports, "report_of")
    watched(endpoints, "delivery_report_page")
    watched(endpoints, "json_answer")
    journal = service.services.journal
    read = journal.read

    async def counted(after: int, limit: int, run_id: str | None = None) -> Any:
        limits.append(limit)
        return await read(after, limit, run_id=run_id)

    monkeypatch.setattr(journal, "read", counted)
    for path in ("delivery-report", "delivery-report.html"):
        assert (await service.call("GET", f"/api/v1/runs/{run_id}/{path}"))[0] == 200
    assert set(worked) == {"take", "report_of", "delivery_report_page", "json_answer"}
    assert all(threading.get_ident() not in threads for threads in worked.values()), worked
    assert max(limits) <= 100


async def test_the_sheet_is_a_page_without_scripts_that_prints_what_was_typed_and_runs_none_of_it(
    service: Service, plan: dict[str, Any]
) -> None:
    order = {"id": HOSTILE, "recipient": HOSTILE, "notes": HOSTILE}
    run_id = await proven(service, {**plan, "name": HOSTILE[:200], "order": order})
    status, headers, sheet = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report.html")
    assert status == 200
    assert headers["Content-Type"] == "text/html; charset=utf-8"
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert "script" not in headers["Content-Security-Policy"]
    assert "<script" not in sheet
    assert sheet.count("&lt;script&gt;alert(1)&lt;/script&gt;") == 5  # the title, the head, and three of the order
    assert "The run is in progress" in sheet


async def test_the_pictures_show_the_planned_point_and_the_fences(service: Service, plan: dict[str, Any]) -> None:
    run_id = await proven(service, plan)
    _, _, sheet = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report.html")
    picture = ElementTree.fromstring(sheet[sheet.index("<svg") : sheet.index("</svg>") + len("</svg>")])
    kinds = [shape.get("class") for shape in picture]
    assert kinds.count("planned") == 1
    assert kinds.count("route") == 1
    assert kinds.count("keep-in") == len(plan["geofence"]["polygons"])
    assert kinds.count("keep-out") == len(plan["geofence"]["circles"])


@pytest.mark.parametrize("path", ["delivery-report", "delivery-report.html"])
async def test_an_unknown_run_has_no_delivery_report(service: Service, path: str) -> None:
    status, _, problem = await service.call("GET", f"/api/v1/runs/run-none/{path}")
    assert (status, problem["code"]) == (404, "resource.not_found")


async def test_a_saved_copy_of_the_sheet_has_the_policy_in_itself(service: Service, plan: dict[str, Any]) -> None:
    run_id = await proven(service, plan)
    _, headers, sheet = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report.html")
    policy = sheet.partition('<meta http-equiv="Content-Security-Policy" content="')[2].partition('"')[0]
    assert "default-src 'none'" in policy
    assert set(policy.split("; ")) <= set(headers["Content-Security-Policy"].split("; "))
    assert sheet.index("Content-Security-Policy") < sheet.index("<style>")


async def test_text_that_turns_the_writing_round_turns_only_itself(service: Service, plan: dict[str, Any]) -> None:
    turned = "Anna \u05e9\u05dc\u05d5\u05dd 12"
    order = {"id": turned, "recipient": turned, "notes": turned}
    run_id = await proven(service, {**plan, "name": turned, "order": order})
    _, _, sheet = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report.html")
    shown = sheet[sheet.index("<body>") :]
    assert shown.count(turned) == shown.count(f"<bdi>{turned}</bdi>") == 4  # the name, and three of the order


async def test_an_event_is_told_to_its_last_brace_and_a_drop_does_not_speak_of_sensors_that_may_be_there(
    service: Service, plan: dict[str, Any]
) -> None:
    run_id = await proven(service, plan)
    journal = service.services.journal
    await journal.record(
        journal.new_event(SimulatorFault(fault="wind", actor="x", value={"a": {"b": 1}}), run_id=run_id)
    )
    _, _, sheet = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report.html")
    assert "&quot;value&quot;: {&quot;a&quot;: {&quot;b&quot;: 1}}" in sheet
    assert "nothing sensed" in sheet
    assert "no sensor" not in sheet
