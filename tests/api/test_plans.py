"""Plans over REST."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from app.domain.rules import Finding, Severity
from app.services.plan_checks import PlanCheck
from tests.support.service_in_process import Service, run_service


async def test_a_plan_is_stored_and_found_at_its_location(service: Service, plan: dict[str, Any]) -> None:
    status, headers, made = await service.call("POST", "/api/v1/plans", json=plan)
    assert status == 201
    assert made["created_by"] == "local"

    status, headers, read = await service.call("GET", headers["Location"])
    assert (status, read) == (200, made)
    assert read["plan"]["name"] == "Clinic run"
    assert read["timeline"] is not None

    status, _, listed = await service.call("GET", "/api/v1/plans?limit=1")
    assert status == 200
    assert [entry["id"] for entry in listed["plans"]] == [made["id"]]


async def test_plans_come_page_by_page_while_others_are_stored(service: Service, plan: dict[str, Any]) -> None:
    made = [(await service.call("POST", "/api/v1/plans", json=plan))[2]["id"] for _ in range(5)]
    seen, path = [], "/api/v1/plans?limit=2"
    following: str | None = ""
    while following is not None:
        _, _, page = await service.call("GET", path + (f"&older_than={following}" if following else ""))
        seen += [one["id"] for one in page["plans"]]
        following = page["next"]
        await service.call("POST", "/api/v1/plans", json=plan)
    assert seen == made[::-1]
    status, _, problem = await service.call("GET", "/api/v1/plans?older_than=plan-9")
    assert (status, problem["code"]) == (404, "resource.not_found")


async def test_a_client_that_has_the_plan_is_not_sent_it_again(service: Service, plan: dict[str, Any]) -> None:
    _, headers, made = await service.call("POST", "/api/v1/plans", json=plan)
    path, etag = headers["Location"], headers["ETag"]
    for known in (etag, f"W/{etag}", f'"other", {etag}', "*"):
        status, headers, body = await service.call("GET", path, headers={"If-None-Match": known})
        assert (status, body, headers["ETag"]) == (304, "", etag)
    status, _, body = await service.call("GET", path, headers={"If-None-Match": '"other"'})
    assert (status, body["id"]) == (200, made["id"])


async def test_a_client_gets_what_another_version_finds_in_the_same_plan(
    tmp_path: Path, plan: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    async with run_service(tmp_path) as before:
        _, headers, made = await before.call("POST", "/api/v1/plans", json=plan)
    finding = Finding(code="battery.new", severity=Severity.WARNING, pointer="", message="found by this version only")
    monkeypatch.setattr("app.services.plans.check", lambda *_: PlanCheck(findings=(finding,), timeline=None))
    async with run_service(tmp_path) as after:
        known = {"If-None-Match": headers["ETag"]}
        status, changed, read = await after.call("GET", headers["Location"], headers=known)
        assert (status, [one["code"] for one in read["findings"]]) == (200, ["battery.new"])
        assert (read["hash"], changed["ETag"] != headers["ETag"]) == (made["hash"], True)


async def test_a_document_that_is_no_plan_is_refused_with_pointers(service: Service, plan: dict[str, Any]) -> None:
    del plan["name"]
    plan["items"][1]["latitude_deg"] = 91
    status, headers, problem = await service.call("POST", "/api/v1/plans", json=plan)
    assert (status, problem["code"]) == (422, "plan.invalid")
    assert headers["Content-Type"].startswith("application/problem+json")
    assert {finding["pointer"] for finding in problem["findings"]} == {"/name", "/items/1/latitude_deg"}


async def test_a_plan_that_cannot_be_flown_is_refused_with_findings(service: Service, plan: dict[str, Any]) -> None:
    plan["items"].insert(0, plan["items"].pop(3))
    status, _, problem = await service.call("POST", "/api/v1/plans", json=plan)
    assert (status, problem["code"]) == (422, "plan.rejected")
    assert any(finding["severity"] == "error" for finding in problem["findings"])
    _, _, listed = await service.call("GET", "/api/v1/plans")
    assert listed["plans"] == []


async def test_a_check_answers_200_for_good_plans_and_for_bad_ones(service: Service, plan: dict[str, Any]) -> None:
    status, _, good = await service.call("POST", "/api/v1/plan-checks", json={"plan": plan})
    assert status == 200
    assert not any(finding["severity"] == "error" for finding in good["findings"])
    assert good["timeline"] is not None
    assert good["parameters_age_s"] is None

    status, _, with_vehicle = await service.call(
        "POST", "/api/v1/plan-checks", json={"plan": plan, "vehicle": service.v1}
    )
    assert status == 200
    assert with_vehicle["timeline"] is not None
    assert with_vehicle["parameters_age_s"] == 2.5

    broken_ones: list[Any] = [{}, [], "text", None, 7, {**plan, "colour": "red"}]
    for broken in broken_ones:
        status, _, check = await service.call("POST", "/api/v1/plan-checks", json={"plan": broken})
        assert (status, check["timeline"]) == (200, None)
        assert check["findings"]
    _, _, listed = await service.call("GET", "/api/v1/plans")
    assert listed["plans"] == []


async def test_a_check_tells_a_wind_that_nobody_gave_from_calm_air(service: Service, plan: dict[str, Any]) -> None:
    _, _, assumed = await service.call("POST", "/api/v1/plan-checks", json={"plan": plan})
    assert assumed["timeline"]["wind"] == {"north_m_s": 0.0, "east_m_s": 0.0, "given": False}
    calm = {"from_deg": 0, "speed_m_s": 0}
    _, _, told = await service.call("POST", "/api/v1/plan-checks", json={"plan": plan, "wind": calm})
    assert told["timeline"]["wind"]["given"] is True


@pytest.mark.parametrize("wind", [{"from_deg": 270, "speed_m_s": 8}, {"north_m_s": 0, "east_m_s": 8}])
async def test_a_check_reckons_with_the_wind_that_it_is_given(
    service: Service, plan: dict[str, Any], wind: dict[str, float]
) -> None:
    status, _, check = await service.call("POST", "/api/v1/plan-checks", json={"plan": plan, "wind": wind})
    assert status == 200
    assert check["timeline"]["wind"] == {"north_m_s": pytest.approx(0.0), "east_m_s": pytest.approx(8.0), "given": True}
    drop = check["timeline"]["drops"][0]
    assert drop["landing_longitude_deg"] > drop["release_longitude_deg"]


@pytest.mark.parametrize(
    "wind", [{}, {"from_deg": 270}, {"from_deg": 270, "speed_m_s": 8, "east_m_s": 1}, {"from_deg": 10, "speed_m_s": -1}]
)
async def test_half_a_wind_is_refused(service: Service, plan: dict[str, Any], wind: dict[str, float]) -> None:
    status, _, problem = await service.call("POST", "/api/v1/plan-checks", json={"plan": plan, "wind": wind})
    assert (status, problem["code"]) == (422, "request.invalid")


async def test_a_check_against_an_unknown_vehicle_is_404(service: Service, plan: dict[str, Any]) -> None:
    status, _, problem = await service.call("POST", "/api/v1/plan-checks", json={"plan": plan, "vehicle": "v9"})
    assert (status, problem["code"]) == (404, "resource.not_found")
