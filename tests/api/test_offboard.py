"""Offboard control by REST: who may, what is refused with which code, and that it reaches the vehicle."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from app.domain.offboard.messages import LocalTarget
from app.domain.vehicle.state import FirmwareVersion, FlightMode, VehicleType
from app.services.access import Role
from tests.support.fake_links import FakeLink
from tests.support.listener import listen
from tests.support.offboard_api import NORTH, PATH, link
from tests.support.service_in_process import Service, until

__all__ = ["link"]


async def take(service: Service, **more: Any) -> dict[str, str]:
    """The lease, as the body of what its holder does."""
    status, headers, grant = await service.call("POST", f"{PATH}/lease", json={}, **more)
    assert (status, headers["Location"], grant["holder"]) == (201, PATH, grant["holder"])
    return {"lease": grant["lease"]}


async def post(service: Service, path: str, body: dict[str, Any]) -> tuple[int, Any]:
    status, _, answer = await service.call("POST", f"{PATH}/{path}", json=body)
    return status, answer


async def test_a_vehicle_says_which_setpoints_it_follows_and_why_not_others(service: Service, link: FakeLink) -> None:
    status, _, detail = await service.call("GET", PATH)
    assert (status, detail["offboard"]["state"], detail["offboard"]["lease"]) == (200, "idle", None)
    rows = {row["form"]: row for row in detail["capabilities"]}
    assert rows["position_ned"]["accepted"]
    assert (rows["position_ned"]["type_mask"], rows["position_ned"]["frame"]) == (3576, "LOCAL_NED")
    assert rows["acceleration_global"]["code"] == "setpoint.acceleration_is_thrust"
    assert detail["limits"]["max_speed_m_s"] == 10.0


@pytest.mark.parametrize(
    ("vehicle_type", "firmware", "control_method", "why"),
    [
        (VehicleType.MULTICOPTER, (1, 14, 3), "setpoints", ""),
        (VehicleType.FIXED_WING, (1, 16, 0), "setpoints", ""),
        (VehicleType.FIXED_WING, (1, 14, 3), "commands", ""),
        (VehicleType.AIRSHIP, (1, 16, 0), None, "none that flies to a place"),
    ],
)
async def test_a_vehicle_says_how_it_flies_tasks_or_why_not(
    service: Service,
    link: FakeLink,
    vehicle_type: VehicleType,
    firmware: tuple[int, int, int],
    control_method: str | None,
    why: str,
) -> None:
    link.identity = replace(link.identity, vehicle_type=vehicle_type, firmware=FirmwareVersion(*firmware))
    _, _, detail = await service.call("GET", PATH)
    assert detail["tasks"]["control_method"] == control_method
    assert why in detail["tasks"]["reason"]
    assert bool(detail["tasks"]["reason"]) == bool(detail["tasks"]["hint"]) == (control_method is None)


async def test_the_whole_way_of_a_pilot(service: Service, link: FakeLink) -> None:
    lease = await take(service)
    assert (await post(service, "setpoint", {**lease, "setpoint": NORTH}))[0] == 200
    status, entered = await post(service, "enter", lease)
    assert (status, entered["offboard"]["state"], link.state().mode) == (200, "active", FlightMode.OFFBOARD)
    assert entered["audit"][0]["parameter"] == "COM_OBL_RC_ACT"
    status, taken = await post(service, "setpoint", {**lease, "setpoint": {**NORTH, "north_m_s": 50.0}})
    assert (status, [clamp["code"] for clamp in taken["clamped"]]) == (200, ["limit.speed"])
    await until(lambda: isinstance(m := link.setpoints[-1], LocalTarget) and m.velocity[0] == 10.0, timeout_s=10)
    _, _, detail = await service.call("GET", PATH)
    assert detail["offboard"]["sent"]["clamped"] == ["limit.speed"]
    status, left = await post(service, "leave", {**lease, "to": "return"})
    assert (status, left["lease"], link.state().mode) == (200, None, FlightMode.RETURN)


async def test_one_client_at_a_time(service: Service, link: FakeLink) -> None:
    lease = await take(service)
    status, _, problem = await service.call("POST", f"{PATH}/lease", json={})
    assert (status, problem["code"], problem["holder"]) == (409, "offboard.lease_held", "local")
    assert (await post(service, "lease/renew", lease))[0] == 200
    status, view = await post(service, "lease/hand-over", {**lease, "to": "local"})
    assert (status, view["lease"]["offered_to"]) == (200, "local")
    taken_over = await take(service)
    for path, body in (("lease/renew", lease), ("setpoint", {**lease, "setpoint": NORTH}), ("leave", lease)):
        status, problem = await post(service, path, body)
        assert (status, problem["code"]) == (409, "offboard.lease_lost"), path
    assert (await post(service, "lease/release", taken_over))[1]["lease"] is None


async def test_what_is_not_ready_is_not_entered(service: Service, link: FakeLink) -> None:
    lease = await take(service)
    link.change(armed=False)
    status, problem = await post(service, "enter", lease)
    assert (status, problem["code"]) == (409, "offboard.not_ready")
    link.change(armed=True)
    link.parameters = {"COM_OBL_RC_ACT": 0}
    status, problem = await post(service, "enter", lease)
    assert (status, problem["code"]) == (409, "offboard.audit_failed")
    assert problem["audit"][0]["parameter"] == "COM_OBL_RC_ACT"
    assert link.setpoints == []
    assert (await post(service, "enter", {**lease, "sticks_held": True}))[0] == 200


async def test_what_would_keep_an_entry_from_beginning_is_told_before_and_commands_nothing(
    service: Service, link: FakeLink
) -> None:
    status, _, check = await service.call("GET", f"{PATH}/entry-check")
    assert (status, check["ready"], check["reason"]) == (200, True, "")
    assert {entry["parameter"] for entry in check["audit"]} >= {"COM_OBL_RC_ACT", "COM_OF_LOSS_T", "NAV_DLL_ACT"}
    link.change(armed=False)
    link.parameters = {"COM_OBL_RC_ACT": 0}
    _, _, check = await service.call("GET", f"{PATH}/entry-check")
    assert (check["ready"], check["reason"]) == (False, "vehicle v1 is not armed")
    assert [entry["parameter"] for entry in check["audit"] if entry["blocks"]] == ["COM_OBL_RC_ACT"]
    link.change(armed=True)
    _, _, check = await service.call("GET", f"{PATH}/entry-check?sticks_held=true")
    assert check["ready"]
    link.change(connected=False)
    _, _, check = await service.call("GET", f"{PATH}/entry-check")
    assert (check["ready"], check["audit"]) == (False, [])
    assert (link.setpoints, link.state().mode) == ([], FlightMode.HOLD)
    token = await service.token(Role.DISPATCHER)
    status, _, problem = await service.call("GET", f"{PATH}/entry-check", headers=token)
    assert (status, problem["code"]) == (403, "role.insufficient")


@pytest.mark.parametrize(
    ("setpoint", "refusal"),
    [
        ({"type": "position_body", "forward_m": 3.0}, "setpoint.frame_unsupported"),
        ({"type": "actuators", "outputs": [0.1]}, "setpoint.bypasses_control"),
        ({"type": "body_rates", "thrust": 0.5}, "limit.tilt"),
    ],
)
async def test_a_setpoint_that_is_not_sent_says_why(
    service: Service, link: FakeLink, setpoint: dict[str, Any], refusal: str
) -> None:
    lease = await take(service)
    status, problem = await post(service, "setpoint", {**lease, "setpoint": setpoint})
    assert (status, problem["code"], problem["refusal"]) == (422, "setpoint.refused", refusal)
    status, problem = await post(service, "setpoint", {**lease, "setpoint": {"type": "warp"}})
    assert (status, problem["code"]) == (422, "request.invalid")


async def test_pilots_may_and_others_may_not(service: Service, link: FakeLink) -> None:
    for role, status in ((Role.VIEWER, 403), (Role.DISPATCHER, 403), (Role.PILOT, 201)):
        token = await service.token(role)
        found, _, _ = await service.call("POST", f"{PATH}/lease", json={}, headers=token)
        assert found == status, role
    admin = await service.token(Role.ADMIN)
    status, _, problem = await service.call("POST", f"{PATH}/lease", json={"override": True}, headers=token)
    assert (status, problem["code"]) == (403, "role.insufficient")
    status, _, grant = await service.call("POST", f"{PATH}/lease", json={"override": True}, headers=admin)
    assert (status, grant["holder"]) == (201, "a admin")


async def test_everybody_who_watches_sees_what_is_sent_and_who_has_the_lease(service: Service, link: FakeLink) -> None:
    async with listen(service) as watcher:
        lease = await take(service)
        await post(service, "enter", lease)
        await post(service, "setpoint", {**lease, "setpoint": NORTH})
        kinds: set[str] = set()
        while not {"offboard.lease", "offboard.changed"} <= kinds:
            kinds.add((await watcher.event())["kind"])
        while True:
            offboard = (await watcher.frame("telemetry"))["vehicles"]["v1"]["offboard"]
            if offboard is not None and offboard["state"] == "active" and offboard["sent"]["source"] == "client":
                break
        assert offboard["sent"]["setpoint"]["north_m_s"] == 2.0
        assert offboard["rate"]["achieved_hz"] > 0
        assert offboard["lease"]["holder"] == "local"
        assert lease["lease"] not in str(offboard)


async def test_an_unknown_vehicle_has_no_offboard_control(service: Service) -> None:
    for method, path, body in (("GET", "", None), ("POST", "/lease", {}), ("POST", "/enter", {"lease": "x"})):
        status, _, problem = await service.call(method, f"/api/v1/vehicles/v99/offboard{path}", json=body)
        assert (status, problem["code"]) == (404, "resource.not_found")
