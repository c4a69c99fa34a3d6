"""Plans of other software over REST: in with every loss named, out with a file name."""

from __future__ import annotations

import json
import os
from typing import Any

import pytest

from app.services.access import Role
from app.services.plan_work import LARGE_DOCUMENT_BYTES
from tests.support.paths import DATA
from tests.support.service_in_process import Service
from tests.support.workers import workers_of

FILES = DATA / "interchange"
PLAN_FILE = (FILES / "multicopter-delivery.plan").read_bytes()
WAYPOINTS = (FILES / "mission-planner.waypoints").read_bytes()
JSON = {"Content-Type": "application/json"}
BINARY = {"Content-Type": "application/octet-stream"}
CONVERSIONS = "/api/v1/plan-conversions"


async def test_a_plan_file_is_converted_and_the_plan_is_one_that_can_be_stored(service: Service) -> None:
    status, _, answer = await service.call("POST", f"{CONVERSIONS}?name=Field", data=PLAN_FILE, headers=JSON)
    assert (status, answer["format"], answer["plan"]["name"]) == (200, "qgc", "Field")
    assert [(finding["kind"], finding["code"]) for finding in answer["findings"]] == [
        ("assumed", "conversion.release_motion")
    ]
    _, _, listed = await service.call("GET", "/api/v1/plans")
    assert listed["plans"] == []

    status, _, made = await service.call("POST", "/api/v1/plans", json=answer["plan"])
    assert status == 201
    assert made["plan"] == answer["plan"]


@pytest.mark.parametrize("is_large", [False, True])
async def test_a_large_file_is_read_in_the_worker_process_and_answered_like_any_other(
    service: Service, *, is_large: bool
) -> None:
    padded = b" " * (LARGE_DOCUMENT_BYTES if is_large else 0)
    status, headers, answer = await service.call("POST", CONVERSIONS, data=PLAN_FILE + padded, headers=JSON)
    assert (status, answer["format"], headers["Content-Type"]) == (200, "qgc", "application/json")
    survey = (FILES / "survey.plan").read_bytes() + padded
    status, _, problem = await service.call("POST", CONVERSIONS, data=survey, headers=JSON)
    assert (status, problem["code"]) == (422, "conversion.refused")
    assert [finding["pointer"] for finding in problem["findings"]] == ["/mission/items/1/complexItemType"]
    bad = b'{"version": 1, "items": [], "vehicle_type": "x"}' + padded
    status, _, problem = await service.call("POST", CONVERSIONS, data=bad, headers=JSON)
    assert (status, problem["code"]) == (422, "plan.invalid")
    assert len(workers_of(os.getpid())) == is_large


async def test_a_waypoint_file_is_converted_and_a_format_can_be_insisted_on(service: Service) -> None:
    status, _, answer = await service.call("POST", CONVERSIONS, data=WAYPOINTS, headers=BINARY)
    assert (status, answer["format"]) == (200, "waypoints")
    path = f"{CONVERSIONS}?format=waypoints&vehicle_type=vtol"
    status, _, problem = await service.call("POST", path, data=WAYPOINTS, headers=BINARY)
    assert (status, problem["code"]) == (422, "conversion.refused")
    assert {finding["code"] for finding in problem["findings"]} == {"conversion.vtol_takeoff"}
    status, _, problem = await service.call("POST", f"{CONVERSIONS}?format=qgc", data=WAYPOINTS, headers=BINARY)
    assert (status, problem["findings"][0]["code"]) == (422, "conversion.format")
    status, _, problem = await service.call("POST", f"{CONVERSIONS}?format=kml", data=WAYPOINTS, headers=BINARY)
    assert (status, problem["code"]) == (400, "request.query_invalid")


async def test_only_conversions_take_what_is_not_json(service: Service) -> None:
    status, _, problem = await service.call("POST", "/api/v1/plans", data=PLAN_FILE, headers=BINARY)
    assert (status, problem["code"]) == (415, "request.content_type")
    status, _, problem = await service.call("POST", CONVERSIONS, data=WAYPOINTS, headers={"Content-Type": "text/plain"})
    assert (status, problem["code"]) == (415, "request.content_type")
    assert "application/octet-stream" in problem["hint"]


async def test_what_cannot_become_a_plan_is_refused_with_every_place(service: Service) -> None:
    survey = (FILES / "survey.plan").read_bytes()
    status, headers, problem = await service.call("POST", CONVERSIONS, data=survey, headers=JSON)
    assert (status, problem["code"]) == (422, "conversion.refused")
    assert headers["Content-Type"].startswith("application/problem+json")
    assert [finding["pointer"] for finding in problem["findings"]] == ["/mission/items/1/complexItemType"]


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b"\xff", b"[" * 5000, b'{"fileType": "Plan", "mission": NaN}'])
async def test_no_bytes_are_a_defect(service: Service, body: bytes) -> None:
    for headers in (JSON, BINARY):
        status, _, problem = await service.call("POST", CONVERSIONS, data=body, headers=headers)
        assert status in (400, 422)
        assert problem["code"] in ("request.malformed", "conversion.refused")


async def test_a_stored_plan_is_exported_in_every_format(service: Service, plan: dict[str, Any]) -> None:
    _, headers, _ = await service.call("POST", "/api/v1/plans", json=plan)
    exports = headers["Location"] + "/exports"
    status, _, listed = await service.call("GET", exports)
    assert status == 200
    assert [entry["format"] for entry in listed["exports"]] == ["qgc", "geojson", "kml"]
    assert ("lost", "/items/3") in {
        (finding["kind"], finding["pointer"]) for finding in listed["exports"][0]["findings"]
    }
    for entry, suffix in zip(listed["exports"], (".plan", ".geojson", ".kml"), strict=True):
        status, headers, body = await service.call("GET", entry["path"])
        assert status == 200
        assert headers["Content-Type"].split(";")[0] == entry["media_type"]
        assert headers["Content-Disposition"] == f'attachment; filename="clinic-run{suffix}"'
        known = {"If-None-Match": headers["ETag"]}
        assert (await service.call("GET", entry["path"], headers=known))[0] == 304
        assert body


async def test_what_is_exported_for_qgroundcontrol_comes_back_as_the_same_plan(
    service: Service, plan: dict[str, Any]
) -> None:
    _, headers, made = await service.call("POST", "/api/v1/plans", json=plan)
    _, _, document = await service.call("GET", headers["Location"] + "/exports/qgc")
    status, _, answer = await service.call("POST", CONVERSIONS, data=json.dumps(document).encode(), headers=JSON)
    assert (status, answer["plan"], answer["findings"]) == (200, made["plan"], [])


async def test_there_is_no_other_format_and_no_other_plan(service: Service, plan: dict[str, Any]) -> None:
    _, headers, _ = await service.call("POST", "/api/v1/plans", json=plan)
    status, _, problem = await service.call("GET", headers["Location"] + "/exports/gpx")
    assert (status, problem["code"]) == (404, "path.not_found")
    for name in ("", "/qgc", "/geojson", "/kml"):
        status, _, problem = await service.call("GET", f"/api/v1/plans/none/exports{name}")
        assert (status, problem["code"]) == (404, "resource.not_found")


async def test_a_viewer_may_export_and_only_a_dispatcher_convert(service: Service, plan: dict[str, Any]) -> None:
    _, headers, _ = await service.call("POST", "/api/v1/plans", json=plan)
    viewer, dispatcher = await service.token(Role.VIEWER), await service.token(Role.DISPATCHER)
    assert (await service.call("GET", headers["Location"] + "/exports/kml", headers=viewer))[0] == 200
    status, _, problem = await service.call("POST", CONVERSIONS, data=PLAN_FILE, headers={**JSON, **viewer})
    assert (status, problem["code"]) == (403, "role.insufficient")
    assert (await service.call("POST", CONVERSIONS, data=PLAN_FILE, headers={**JSON, **dispatcher}))[0] == 200
