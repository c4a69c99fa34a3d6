"""A fault of a simulated vehicle is set over REST: the vehicle has it, the journal tells it, and clearing it heals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import aiohttp

from tests.support.forked_service import ForkedService
from tests.support.service_process import Dispatcher, until
from tests.support.simulated import SimulatedFleet

LINK_S = 30.0
"""It ends a hang: a link is lost after 3 s without HEARTBEAT."""
SILENT = "simulator.no_answer"
"""It did not answer within 2 s, which may happen on a busy machine."""


async def test_a_link_that_is_cut_is_lost_and_comes_back_when_the_fault_is_cleared(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    with SimulatedFleet("quad,quad") as fleet:
        control = f"127.0.0.1:{fleet.control_port}"
        with ForkedService(tmp_path, fleet.connections, WAYDROP_SIMULATOR_CONTROL=control) as service:
            dispatcher = Dispatcher(http, service.url)
            await dispatcher.until_vehicles(2)
            await cut_link(dispatcher, True)
            await until_faults(dispatcher, {"v1": {"link_cut": True}, "v2": {}})
            lost = [("simulator.fault", True), ("vehicle.link_lost", None)]
            await until_story(dispatcher, lost)
            await until_connected(dispatcher, {"v1": False, "v2": True})
            await cut_link(dispatcher, False)
            await until_story(dispatcher, [*lost, ("simulator.fault", False), ("vehicle.link_restored", None)])
            await until_connected(dispatcher, {"v1": True, "v2": True})
            await until_faults(dispatcher, {"v1": {}, "v2": {}})
            fleet.close()
            view = await dispatcher.get("/simulator")
            assert (view["available"], view["vehicles"]) == (False, [])


async def cut_link(dispatcher: Dispatcher, value: bool) -> None:
    """Set or clear the fault of v1; again while the simulator is silent."""

    async def answer() -> Any:
        try:
            return await dispatcher.post("/simulator/faults", {"vehicle": "v1", "fault": "link_cut", "value": value})
        except AssertionError as error:
            if SILENT not in str(error):
                raise
            return None

    done = await until(answer, bool, "the simulator must answer", LINK_S)
    assert done["vehicle_ids"] == ["v1"]


async def until_faults(dispatcher: Dispatcher, wanted: dict[str, Any]) -> None:
    """Wait until the simulator tells these faults of each vehicle; while it is silent, no vehicle is told."""

    async def told() -> dict[str, Any]:
        view = await dispatcher.get("/simulator")
        return {vehicle["vehicle_id"]: vehicle["faults"] for vehicle in view["vehicles"]}

    await until(told, lambda found: found == wanted, f"the faults must be {wanted}", LINK_S)


async def until_connected(dispatcher: Dispatcher, wanted: dict[str, bool]) -> None:
    """Wait until these vehicles are heard: on a busy machine the other link may be lost for a moment, too."""

    async def heard() -> dict[str, bool]:
        vehicles = (await dispatcher.get("/vehicles"))["vehicles"]
        return {vehicle["id"]: vehicle["state"]["connected"] for vehicle in vehicles}

    await until(heard, lambda found: found == wanted, f"connected must be {wanted}", LINK_S)


async def until_story(dispatcher: Dispatcher, wanted: list[tuple[str, Any]]) -> None:
    """Wait until the journal tells these faults and link changes of v1 in this order, with the faults' values.

    A busy machine may lose the link, and find it again, besides.
    """
    kinds = {"simulator.fault", "vehicle.link_lost", "vehicle.link_restored"}

    async def told() -> list[tuple[str, Any]]:
        events = (await dispatcher.get("/events?limit=500"))["events"]
        return [(e["kind"], e["data"].get("value")) for e in events if e["kind"] in kinds and e["vehicle_id"] == "v1"]

    def tells(found: list[tuple[str, Any]]) -> bool:
        rest = iter(found)
        return all(one in rest for one in wanted)

    await until(told, tells, f"the journal must tell {wanted}", LINK_S)
