"""The simulated vehicles over REST: what they truly do, and faults that are checked, recorded, then set."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.api import ApiServices
from app.domain.ports.simulated_vehicles import FAULT_KINDS
from app.domain.vehicle.state import LandedState
from app.services.access import Role
from app.services.simulation import Simulation
from app.vehicles.simulator_control import SimulatorControlSocket
from tests.api.broken_parts import without_journal
from tests.support.events import data_of
from tests.support.fake_links import MEASURED_CLOCK
from tests.support.runs_api import create, reaches
from tests.support.scripted_simulator import ScriptedSimulator
from tests.support.service_in_process import Service, run_service

VIEW = "/api/v1/simulator"
FAULTS = "/api/v1/simulator/faults"
SPEED = "/api/v1/simulator/speed"
CUT = {"vehicle": "v1", "fault": "link_cut", "value": True}


def with_control(port: int, answer_s: float = 20.0) -> Callable[[ApiServices], ApiServices]:
    control = SimulatorControlSocket("127.0.0.1", port, answer_s=answer_s)
    return lambda services: replace(
        services, simulation=Simulation(control, services.fleet, services.runs, services.journal)
    )


@pytest.fixture
async def simulator() -> AsyncIterator[ScriptedSimulator]:
    async with ScriptedSimulator(1, 2).running() as running:
        yield running


@pytest.fixture
async def simulated(tmp_path: Path, simulator: ScriptedSimulator) -> AsyncIterator[Service]:
    """A service that has seen the simulator's vehicles 1 and 2, and a real one, 3."""
    async with run_service(tmp_path, change=with_control(simulator.port), links=3) as service:
        yield service


async def told(service: Service) -> list[tuple[str | None, dict[str, Any]]]:
    """Vehicle and data of each recorded fault."""
    events = await service.services.journal.read(0, 100)
    return [(event.vehicle_id, data_of(event)) for event in events if event.kind == "simulator.fault"]


async def test_without_a_simulator_there_is_none_to_see_and_no_fault_to_set(service: Service) -> None:
    status, _, view = await service.call("GET", VIEW)
    assert (status, view["configured"], view["available"], view["vehicles"]) == (200, False, False, [])
    assert "without simulated vehicles" in view["reason"]
    status, _, problem = await service.call("POST", FAULTS, json=CUT)
    assert (status, problem["code"]) == (404, "simulator.not_running")
    assert await told(service) == []


async def test_the_true_state_of_each_vehicle_is_shown_under_the_id_it_has_here(
    simulated: Service, simulator: ScriptedSimulator
) -> None:
    simulator.vehicles[0]["faults"] = {"wind": [3.0, 0.0]}
    simulator.vehicles[1]["vehicle"] = 77
    status, _, view = await simulated.call("GET", VIEW)
    assert (status, view["configured"], view["available"], view["reason"]) == (200, True, True, None)
    assert [(v["vehicle_id"], v["system_id"], v["faults"]) for v in view["vehicles"]] == [
        ("v1", 1, {"wind": [3.0, 0.0]}),
        (None, 77, {}),
    ]


async def test_each_fault_is_described_with_the_schema_of_its_value(simulated: Service) -> None:
    _, _, view = await simulated.call("GET", VIEW)
    faults = {kind["fault"]: kind for kind in view["faults"]}
    assert set(faults) == {kind.fault for kind in FAULT_KINDS}
    assert all(kind["effect"] for kind in faults.values())
    assert faults["loss"]["value_schema"].items() >= {"type": "number", "minimum": 0.0, "maximum": 1.0}.items()
    assert "RTL" in faults["mode"]["value_schema"]["enum"]


async def test_a_fault_reaches_the_vehicle_it_names_and_is_in_the_story_of_its_run(
    simulated: Service, simulator: ScriptedSimulator
) -> None:
    simulated.services.fleet.vehicle("v2").own("r-1")
    status, _, body = await simulated.call("POST", FAULTS, json={"vehicle": "v2", "fault": "wind", "value": [3, -2.5]})
    assert (status, body) == (200, {"fault": "wind", "value": [3.0, -2.5], "vehicle_ids": ["v2"]})
    assert simulator.orders == [{"vehicle": 2, "fault": "wind", "value": [3.0, -2.5]}]
    story = await simulated.services.journal.read(0, 100, run_id="r-1")
    assert [(event.kind, event.vehicle_id, data_of(event)["value"]) for event in story] == [
        ("simulator.fault", "v2", [3.0, -2.5])
    ]


async def test_a_fault_for_all_is_told_of_each_simulated_vehicle_and_of_no_other(
    simulated: Service, simulator: ScriptedSimulator
) -> None:
    status, _, body = await simulated.call("POST", FAULTS, json={"vehicle": None, "fault": "loss", "value": 0.1})
    assert (status, body["vehicle_ids"]) == (200, ["v1", "v2"])
    assert simulator.orders == [{"vehicle": None, "fault": "loss", "value": 0.1}]
    assert [vehicle for vehicle, _ in await told(simulated)] == ["v1", "v2"]


async def test_what_the_simulator_refuses_is_told_with_its_reason_and_recorded_as_not_set(
    simulated: Service, simulator: ScriptedSimulator
) -> None:
    simulator.answer_to_faults = {"ok": False, "error": "vehicle 1 has no winch"}
    order = {"vehicle": "v1", "fault": "stuck_winch", "value": True}
    status, _, problem = await simulated.call("POST", FAULTS, json=order)
    assert (status, problem["code"], problem["detail"]) == (409, "simulator.refused", "vehicle 1 has no winch")
    assert [data["problem"] for _, data in await told(simulated)] == [None, "vehicle 1 has no winch"]


async def test_a_vehicle_never_seen_and_a_real_one_get_no_fault(
    simulated: Service, simulator: ScriptedSimulator
) -> None:
    for vehicle, expected in (("v9", (404, "resource.not_found")), ("v3", (409, "simulator.refused"))):
        status, _, problem = await simulated.call("POST", FAULTS, json={**CUT, "vehicle": vehicle})
        assert (status, problem["code"]) == expected
    assert simulator.orders == []
    assert await told(simulated) == []


async def test_a_dead_simulator_is_no_longer_available(tmp_path: Path) -> None:
    async with ScriptedSimulator(1).running() as simulator:
        port = simulator.port
    async with run_service(tmp_path, change=with_control(port)) as service:
        status, _, problem = await service.call("POST", FAULTS, json=CUT)
        assert (status, problem["code"]) == (504, "simulator.no_answer")
        _, _, view = await service.call("GET", VIEW)
        assert (view["configured"], view["available"]) == (True, False), "it may answer later"
        assert f"127.0.0.1:{port}" in view["reason"]


@pytest.mark.parametrize(
    ("answer", "answer_s", "reason"),
    [
        (None, 0.3, "within 0.3 s"),
        (b"hello\n", 20.0, "sent an invalid answer"),
        (b"{}\n", 20.0, "sent an invalid answer"),
    ],
)
async def test_a_simulator_that_says_nothing_or_nonsense_is_no_answer(
    tmp_path: Path, simulator: ScriptedSimulator, answer: bytes | None, answer_s: float, reason: str
) -> None:
    simulator.answer_to_faults = answer
    async with run_service(tmp_path, change=with_control(simulator.port, answer_s)) as service:
        status, _, problem = await service.call("POST", FAULTS, json=CUT)
        assert (status, problem["code"]) == (504, "simulator.no_answer")
        assert reason in problem["detail"]
        assert [data["problem"] for _, data in await told(service)] == [None, problem["detail"]]


@pytest.mark.parametrize(
    ("order", "pointer"),
    [
        ({"vehicle": "v1", "fault": "loss", "value": 1.5}, "/value"),
        ({"vehicle": "v1", "fault": "loss", "value": True}, "/value"),
        ({"vehicle": "v1", "fault": "loss", "value": float("nan")}, "/value"),
        ({"vehicle": "v1", "fault": "loss"}, "/value"),
        ({"vehicle": "v1", "fault": "link_cut", "value": 1}, "/value"),
        ({"vehicle": "v1", "fault": "wind", "value": [1.0]}, "/value/1"),
        ({"vehicle": "v1", "fault": "wind", "value": [99, 0]}, "/value/0"),
        ({"vehicle": "v1", "fault": "mode", "value": "HOLD"}, "/value"),
        ({"vehicle": "v1", "fault": "reboot", "value": False}, "/value"),
        ({"vehicle": "v1", "fault": "refuse_upload", "value": 4.5}, "/value"),
        ({"fault": "link_cut", "value": True}, "/vehicle"),
        ({"vehicle": 1, "fault": "link_cut", "value": True}, "/vehicle"),
        ({"vehicle": "v1", "fault": "link_cut", "value": True, "for_s": 3}, "/for_s"),
        ({"vehicle": "v1", "fault": "earthquake", "value": True}, ""),
        ([], ""),
    ],
)
async def test_a_fault_that_is_none_is_refused_with_its_place_before_the_simulator_hears_of_it(
    simulated: Service, simulator: ScriptedSimulator, order: Any, pointer: str
) -> None:
    status, _, problem = await simulated.call("POST", FAULTS, json=order)
    assert (status, problem["code"]) == (422, "request.invalid")
    assert problem["findings"][0]["pointer"] == pointer
    assert simulator.orders == []


async def test_a_fault_that_cannot_be_recorded_is_not_set(tmp_path: Path, simulator: ScriptedSimulator) -> None:
    def change(services: ApiServices) -> ApiServices:
        return with_control(simulator.port)(without_journal(services))

    async with run_service(tmp_path, change=change) as service:
        status, _, problem = await service.call("POST", FAULTS, json=CUT)
        assert (status, problem["code"]) == (503, "storage.failed")
    assert simulator.orders == []


async def speed_events(service: Service) -> list[dict[str, Any]]:
    events = await service.services.journal.read(0, 100)
    return [data_of(event) for event in events if event.kind == "simulator.speed"]


async def test_a_speed_is_recorded_then_set_shown_with_its_caps_and_told_to_each_simulated_vehicles_clock(
    simulated: Service, simulator: ScriptedSimulator
) -> None:
    status, _, answer = await simulated.call("PUT", SPEED, json={"speed": 20})
    told = {"wanted": 20.0, "achieved": None, "behind": False, "live": False, "live_max": 4.0, "max": 50.0}
    assert (status, answer, simulator.orders) == (200, told, [{"speed": 20.0}])
    assert (await simulated.call("GET", VIEW))[2]["speed"] == told
    assert await speed_events(simulated) == [{"speed": 20.0, "actor": "local", "problem": None}]
    real = MEASURED_CLOCK.least_rate
    assert [link.state().clock.least_rate for link in simulated.links] == [20.0, 20.0, real], "3 is a real one"
    assert (await simulated.call("PUT", SPEED, json={"speed": 4}))[2]["live"] is True


@pytest.mark.parametrize("speed", [0.5, 50.1, True, "4", None])
async def test_a_speed_out_of_its_range_is_refused_before_the_simulator_hears_of_it(
    simulated: Service, simulator: ScriptedSimulator, speed: Any
) -> None:
    status, _, problem = await simulated.call("PUT", SPEED, json={"speed": speed})
    assert (status, problem["findings"][0]["pointer"], simulator.orders) == (422, "/speed", [])


async def test_above_four_times_it_is_refused_while_a_vehicle_is_in_offboard_control(
    simulated: Service, simulator: ScriptedSimulator
) -> None:
    simulated.links[0].change(armed=True, landed=LandedState.IN_AIR)
    status, _, lease = await simulated.call("POST", "/api/v1/vehicles/v1/offboard/lease", json={})
    assert status in (200, 201), lease
    status, _, problem = await simulated.call("PUT", SPEED, json={"speed": 4.5})
    assert (status, problem["code"], simulator.orders) == (409, "simulator.refused", [])
    assert "vehicle v1 is controlled by" in problem["detail"]
    assert (await simulated.call("PUT", SPEED, json={"speed": 4}))[0] == 200


async def test_above_four_times_it_is_refused_while_a_supervised_drop_is_to_come(
    simulated: Service, simulator: ScriptedSimulator, plan: dict[str, Any]
) -> None:
    _, _, made = await simulated.call("POST", "/api/v1/plans", json=plan)
    run = await create(simulated, made["id"], start=True)
    await reaches(simulated, run["id"], "flying")
    status, _, problem = await simulated.call("PUT", SPEED, json={"speed": 10})
    assert (status, problem["code"]) == (409, "simulator.refused")
    assert f"run {run['id']} of vehicle v1 has a supervised drop ahead" in problem["detail"]
    assert simulator.orders == await speed_events(simulated) == []
    assert [link.state().clock.commanded_rate for link in simulated.links] == [None] * 3
    assert (await simulated.call("PUT", SPEED, json={"speed": 3}))[0] == 200


async def test_what_the_simulator_refuses_of_a_speed_is_told_recorded_and_the_clocks_go_on_as_before(
    simulated: Service, simulator: ScriptedSimulator
) -> None:
    simulator.answer_to_faults = {"ok": False, "error": "vehicle 2 is in OFFBOARD"}
    status, _, problem = await simulated.call("PUT", SPEED, json={"speed": 10})
    assert (status, problem["code"], problem["detail"]) == (409, "simulator.refused", "vehicle 2 is in OFFBOARD")
    assert [event["problem"] for event in await speed_events(simulated)] == [None, "vehicle 2 is in OFFBOARD"]
    assert simulated.links[0].state().clock.rate == 1.0


async def test_without_a_simulator_there_is_no_speed(service: Service) -> None:
    assert (await service.call("PUT", SPEED, json={"speed": 2}))[2]["code"] == "simulator.not_running"
    assert (await service.call("GET", VIEW))[2]["speed"] is None


@pytest.mark.parametrize("role", Role)
async def test_pilots_set_the_speed(simulated: Service, role: Role) -> None:
    status, _, _ = await simulated.call("PUT", SPEED, json={"speed": 2}, headers=await simulated.token(role))
    assert status == (200 if role in (Role.PILOT, Role.ADMIN) else 403)


@pytest.mark.parametrize("role", Role)
async def test_viewers_look_and_pilots_set_faults_under_their_name(
    simulated: Service, simulator: ScriptedSimulator, role: Role
) -> None:
    headers = await simulated.token(role)
    assert (await simulated.call("GET", VIEW, headers=headers))[0] == 200
    status, _, _ = await simulated.call("POST", FAULTS, json=CUT, headers=headers)
    may = role in (Role.PILOT, Role.ADMIN)
    assert status == (200 if may else 403)
    assert len(simulator.orders) == int(may)
    assert [data["actor"] for _, data in await told(simulated)] == ([f"a {role.value}"] if may else [])
