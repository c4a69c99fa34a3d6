"""Vehicles over REST, and what a pilot may tell one outside a run."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.domain.errors import LinkError, LinkTimeoutError, VehicleRefusedError, WaydropError
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.facts import DuplicateSystem
from app.domain.vehicle.state import FlightMode
from app.services.access import Role
from tests.support.service_in_process import Service, run_service, until


async def test_all_vehicles_and_each_one_are_shown(service: Service) -> None:
    status, _, body = await service.call("GET", "/api/v1/vehicles")
    assert status == 200
    assert [vehicle["id"] for vehicle in body["vehicles"]] == [service.v1, service.v2]
    status, _, one = await service.call("GET", f"/api/v1/vehicles/{service.v2}")
    assert (status, one["system_id"], one["firmware"]) == (200, 2, "1.17.0")


async def test_an_unknown_vehicle_is_404_and_the_hint_names_the_known_ones(service: Service) -> None:
    status, _, problem = await service.call("GET", "/api/v1/vehicles/v9")
    assert (status, problem["code"]) == (404, "resource.not_found")
    assert f"{service.v1}, {service.v2}" in problem["hint"]


async def test_a_vehicle_that_is_off_after_a_restart_is_said_to_be_away_and_not_to_be_unknown(tmp_path: Path) -> None:
    """Its queue and its runs are still told: "no vehicle" would contradict them."""
    async with run_service(tmp_path) as service:
        off = service.v2
        assert (await service.call("POST", f"/api/v1/job-queues/{off}/stop"))[0] == 200
    async with run_service(tmp_path, links=1) as service:
        _, _, queues = await service.call("GET", "/api/v1/job-queues")
        assert off in [vehicle["queue"]["vehicle_id"] for vehicle in queues["vehicles"]]
        _, _, listed = await service.call("GET", "/api/v1/vehicles")
        assert [vehicle["id"] for vehicle in listed["vehicles"]] == [service.v1]
        for method, path in (("GET", ""), ("POST", "/hold")):
            status, _, problem = await service.call(method, f"/api/v1/vehicles/{off}{path}")
            assert (status, problem["code"]) == (404, "resource.not_found")
            assert "has connected since the service started" in problem["detail"]
            assert "runs and jobs are listed" in problem["hint"]


@pytest.mark.parametrize(("action", "mode"), [("hold", "hold"), ("return", "return"), ("land", "land")])
async def test_a_vehicle_does_what_it_is_told(service: Service, action: str, mode: str) -> None:
    service.links[0].change(armed=True)
    status, headers, body = await service.call("POST", f"/api/v1/vehicles/{service.v1}/{action}")
    assert (status, headers["Location"]) == (202, f"/api/v1/vehicles/{service.v1}")
    assert body["state"]["mode"] == mode


async def test_a_vehicle_that_was_left_in_offboard_is_told_to_hold_on_the_ground(service: Service) -> None:
    service.links[0].change(mode=FlightMode.OFFBOARD)
    status, _, body = await service.call("POST", f"/api/v1/vehicles/{service.v1}/hold")
    assert (status, body["state"]["mode"], body["state"]["armed"]) == (202, "hold", False)


@pytest.mark.parametrize("action", ["return", "land"])
async def test_a_vehicle_on_the_ground_neither_returns_nor_lands(service: Service, action: str) -> None:
    status, _, problem = await service.call("POST", f"/api/v1/vehicles/{service.v1}/{action}")
    assert (status, problem["code"]) == (409, "state.conflict")
    assert "hold" in problem["hint"]


@pytest.mark.parametrize(
    ("error", "status", "code"),
    [
        (VehicleRefusedError("no", result="DENIED"), 409, "vehicle.refused"),
        (LinkTimeoutError("silence"), 504, "vehicle.timeout"),
        (LinkError("broken"), 502, "vehicle.link"),
    ],
)
async def test_what_the_vehicle_answers_is_told_as_it_is(
    service: Service, error: WaydropError, status: int, code: str
) -> None:
    service.links[0].change(armed=True)
    service.links[0].refusal = error
    answered, _, problem = await service.call("POST", f"/api/v1/vehicles/{service.v1}/land")
    assert (answered, problem["code"], problem["detail"]) == (status, code, error.detail)
    if error.extra:
        assert problem["result"] == "DENIED"


async def test_hold_is_not_sent_while_a_failsafe_holds_before_it_acts(service: Service) -> None:
    """PX4 would give the failsafe up."""
    service.links[0].change(armed=True, mode=FlightMode.HOLD, in_failsafe=True, failsafe_delay_s=1.0)
    status, _, problem = await service.call("POST", f"/api/v1/vehicles/{service.v1}/hold")
    assert (status, problem["code"]) == (409, "vehicle.in_failsafe")
    status, _, _ = await service.call("POST", f"/api/v1/vehicles/{service.v1}/land")
    assert status == 202, "a way out"


async def quarantined(service: Service) -> None:
    service.links[0].change(armed=True, mode=FlightMode.MISSION)
    service.links[0].emit(DuplicateSystem(Reason.of(ReasonCode.TWO_CLOCKS)))
    await until(lambda: service.services.fleet.view(service.v1).quarantined is not None)


@pytest.mark.parametrize("action", ["hold", "return", "land"])
async def test_a_quarantined_vehicle_still_takes_hold_return_and_land(service: Service, action: str) -> None:
    await quarantined(service)
    status, _, view = await service.call("POST", f"/api/v1/vehicles/{service.v1}/{action}")
    assert (status, view["state"]["mode"]) == (202, action)
    assert view["quarantined"]["code"] == "vehicle.two_clocks"


@pytest.mark.single
async def test_a_quarantined_vehicle_takes_nothing_else(service: Service) -> None:
    await quarantined(service)
    status, _, problem = await service.call("GET", f"/api/v1/vehicles/{service.v1}/offboard/entry-check")
    assert (status, problem["code"]) == (409, "vehicle.quarantined")


async def test_an_admin_ends_a_quarantine_and_the_audit_says_who(service: Service) -> None:
    await quarantined(service)
    status, _, view = await service.call("POST", f"/api/v1/vehicles/{service.v1}/end-quarantine")
    assert (status, view["quarantined"]) == (200, None)
    status, _, problem = await service.call("POST", f"/api/v1/vehicles/{service.v1}/end-quarantine")
    assert (status, problem["code"]) == (409, "state.conflict"), "it is over"
    _, _, page = await service.call("GET", "/api/v1/audit")
    done = [
        entry for entry in page["entries"] if entry["action"] == "end_quarantine" and entry["outcome"] == "accepted"
    ]
    assert [(entry["actor"], entry["target"]) for entry in done] == [
        ("local", f"/api/v1/vehicles/{service.v1}/end-quarantine")
    ]


async def test_a_pilot_ends_no_quarantine(service: Service) -> None:
    await quarantined(service)
    token = await service.token(Role.PILOT)
    status, _, problem = await service.call("POST", f"/api/v1/vehicles/{service.v1}/end-quarantine", headers=token)
    assert (status, problem["code"]) == (403, "role.insufficient")


async def test_an_admin_gives_a_vehicle_its_key(service: Service) -> None:
    service.guards.keys[1] = "0123456789abcdef"
    status, _, body = await service.call("POST", f"/api/v1/vehicles/{service.v1}/link-key", json={"trust_link": True})
    assert (status, body) == (
        200,
        {"vehicle_id": service.v1, "fingerprint": "0123456789abcdef", "link_security": "signed"},
    )


@pytest.mark.parametrize("body", [{}, {"trust_link": False}, {"trust_link": "yes"}, {"trust_link": True, "key": "x"}])
async def test_a_key_is_sent_only_on_the_word_that_nobody_else_hears_the_link(
    service: Service, body: dict[str, object]
) -> None:
    service.guards.keys[1] = "0123456789abcdef"
    status, _, problem = await service.call("POST", f"/api/v1/vehicles/{service.v1}/link-key", json=body)
    assert (status, problem["code"]) == (422, "request.invalid")


async def test_a_pilot_gives_no_keys(service: Service) -> None:
    token = await service.token(Role.PILOT)
    body = {"trust_link": True}
    status, _, problem = await service.call("POST", f"/api/v1/vehicles/{service.v1}/link-key", json=body, headers=token)
    assert (status, problem["code"]) == (403, "role.insufficient")


async def test_a_vehicle_without_a_key_and_one_that_goes_on_unsigned_are_told_apart(service: Service) -> None:
    body = {"trust_link": True}
    status, _, problem = await service.call("POST", f"/api/v1/vehicles/{service.v1}/link-key", json=body)
    assert (status, problem["code"]) == (404, "resource.not_found")
    service.guards.refusal = LinkTimeoutError("system 1 does not sign with its new key")
    status, _, problem = await service.call("POST", f"/api/v1/vehicles/{service.v1}/link-key", json=body)
    assert (status, problem["code"]) == (504, "vehicle.timeout")
