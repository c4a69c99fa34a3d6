"""A fault of a simulated vehicle is set over REST: the vehicle has it, the journal tells it, and clearing it heals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import aiohttp

from tests.support.forked_service import ForkedService
from tests.support.service_process import Dispatcher, until
from tests.support.simulated import SimulatedFleet

LINK_S = 15.0
"""A link is lost after 3 s without HEARTBEAT."""


async def test_a_link_that_is_cut_is_lost_and_comes_back_when_the_fault_is_cleared(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    with SimulatedFleet("quad,quad") as fleet:
        control = f"127.0.0.1:{fleet.control_port}"
        with ForkedService(tmp_path, fleet.connections, WAYDROP_SIMULATOR_CONTROL=control) as service:
            dispatcher = Dispatcher(http, service.url)
            await dispatcher.until_vehicles(2)
            done = await dispatcher.post("/simulator/faults", {"vehicle": "v1", "fault": "link_cut", "value": True})
            assert done["vehicle_ids"] == ["v1"]
            assert await faults_of(dispatcher) == {"v1": {"link_cut": True}, "v2": {}}
            await until_story(dispatcher, [("simulator.fault", True), ("vehicle.link_lost", None)])
            assert await connected(dispatcher) == {"v1": False, "v2": True}
            await dispatcher.post("/simulator/faults", {"vehicle": "v1", "fault": "link_cut", "value": False})
            healed = [("simulator.fault", False), ("vehicle.link_restored", None)]
            await until_story(dispatcher, [("simulator.fault", True), ("vehicle.link_lost", None), *healed])
            assert await connected(dispatcher) == {"v1": True, "v2": True}
            assert await faults_of(dispatcher) == {"v1": {}, "v2": {}}
            fleet.close()
            view = await dispatcher.get("/simulator")
            assert (view["available"], view["vehicles"]) == (False, [])


async def faults_of(dispatcher: Dispatcher) -> dict[str, Any]:
    """The faults that the simulator tells of each vehicle."""
    view = await dispatcher.get("/simulator")
    return {vehicle["vehicle_id"]: vehicle["faults"] for vehicle in view["vehicles"]}


async def connected(dispatcher: Dispatcher) -> dict[str, bool]:
    """Which vehicles are heard."""
    return {vehicle["id"]: vehicle["state"]["connected"] for vehicle in (await dispatcher.get("/vehicles"))["vehicles"]}


async def until_story(dispatcher: Dispatcher, wanted: list[tuple[str, Any]]) -> None:
    """Wait until the journal tells these faults and link changes of v1, in this order, with the faults' values."""
    kinds = {"simulator.fault", "vehicle.link_lost", "vehicle.link_restored"}

    async def told() -> list[tuple[str, Any]]:
        events = (await dispatcher.get("/events?limit=500"))["events"]
        return [(e["kind"], e["data"].get("value")) for e in events if e["kind"] in kinds and e["vehicle_id"] == "v1"]

    await until(told, lambda found: found == wanted, f"the journal must tell {wanted}", LINK_S)
