"""From POST /runs to a run that is uploaded and verified; the floor is mavsdk's upload of the same items alone.

Verified by the checksum in MISSION_ACK, which simulated vehicles have as PX4 does: nothing is read back in either half.

The service is a process of its own with a simulated vehicle; this process is the dispatch system, and for the floor the
ground station of a second vehicle of the same kind. Both upload in turns. In `upload-loss` all links lose 5 % of the
frames each way and delay the others by 20 ms; a run that fails ends the row. More than 500 items PX4 does not store.
"""

from __future__ import annotations

import asyncio
import json
import tempfile
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from http import HTTPStatus
from pathlib import Path
from statistics import fmean
from typing import Final

import aiohttp

from app.domain.mission import MissionType
from app.domain.plan import parse_plan
from app.domain.plan.compiler import compile_plan
from app.domain.vehicle.state import VehicleProfile, VehicleType
from app.vehicles.mission_wire import WireItem, to_wire
from app.vehicles.native import NativeInstance, NativeSystem, settle_from_thread
from bench.row import Goal, Pair, Round, Row
from bench.rows.plan import survey
from tests.support.service_process import Dispatcher, ServiceProcess
from tests.support.simulated import SimulatedFleet

UPLOAD_S: Final = 120.0
FOUND_S: Final = 30.0
LOOK_S: Final = 0.05
LOSS: Final = 0.05
DELAY_S: Final = 0.02
LOSSY_ITEMS: Final = 40
LOSSY_VEHICLES: Final = 8
"""Of each side: one upload takes two to nine seconds, as it is lucky, so a round is the mean of some."""
SETTLE_S: Final = 0.1
"""Between the end of a run and the next."""


class Uploads:
    """A dispatch system that follows each of its runs on a stream; one that is not read in between would be closed."""

    def __init__(self, http: aiohttp.ClientSession, url: str) -> None:
        self._http = http
        self._runs_url = f"{url}/api/v1/runs"
        self._stream_url = f"{url}/api/v1/stream"
        self._dispatcher = Dispatcher(http, url)

    async def ms(self, plan_id: str, vehicle_id: str) -> float:
        """From the request to the event of the run that is uploaded, which follows the verification."""
        async with self._http.ws_connect(self._stream_url) as stream:
            begun_s = time.perf_counter()
            run_id = await self._created(plan_id, vehicle_id)
            await self._until(stream, run_id, "uploaded")
            took_ms = (time.perf_counter() - begun_s) * 1e3
            await self._dispatcher.post(f"/runs/{run_id}/abort")
            await self._until(stream, run_id, "aborted")
        await asyncio.sleep(SETTLE_S)
        return took_ms

    async def _created(self, plan_id: str, vehicle_id: str) -> str:
        """Asked for again while the link counts as lost: on a bad one now and then three HEARTBEATs in a row are."""
        async with asyncio.timeout(UPLOAD_S):
            while True:
                async with self._http.post(self._runs_url, json={"plan": plan_id, "vehicle": vehicle_id}) as answer:
                    if answer.status != HTTPStatus.CONFLICT:
                        answer.raise_for_status()
                        return str((await answer.json())["id"])
                await asyncio.sleep(LOOK_S)

    @staticmethod
    async def _until(stream: aiohttp.ClientWebSocketResponse, run_id: str, state: str) -> None:
        async with asyncio.timeout(UPLOAD_S):
            while True:
                said = json.loads(await stream.receive_str())
                event = said.get("event", {})
                if event.get("run_id") == run_id and event["kind"] == "run.changed":
                    if event["data"]["state"] == state:
                        return
                    if event["data"]["state"] == "failed":
                        raise RuntimeError(f"the run failed: {event['data']}")


async def floor_ms(system: NativeSystem, items: Sequence[WireItem]) -> float:
    """mavsdk's upload, tried again until it succeeds."""
    begun_s = time.perf_counter()
    result = ""
    while result != "SUCCESS":
        done: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        system.upload(MissionType.MISSION, items, lambda name, of=done: settle_from_thread(of, name))  # type: ignore[misc]
        async with asyncio.timeout(UPLOAD_S):
            result = await done
    return (time.perf_counter() - begun_s) * 1e3


async def found(instance: NativeInstance) -> NativeSystem:
    """The vehicle on a connection of mavsdk."""
    for _ in range(round(FOUND_S / LOOK_S)):
        for system in instance.new_systems():
            return system
        await asyncio.sleep(LOOK_S)
    raise TimeoutError("the vehicle was not found")


@asynccontextmanager
async def instances(connections: Sequence[str]) -> AsyncIterator[Sequence[NativeInstance]]:
    """mavsdk on each connection."""
    begun = [NativeInstance(connection) for connection in connections]
    try:
        yield begun
    finally:
        for instance in begun:
            instance.destroy()


@asynccontextmanager
async def prepared(items: int, *, vehicles: int = 1, lossy: bool = False) -> AsyncIterator[Round]:
    """So many vehicles of the service, and as many of mavsdk. All of a side upload at the same time."""
    document = survey(items)
    facts = VehicleProfile(VehicleType.MULTICOPTER, max_mission_items=2 * items)
    wire = to_wire(compile_plan(parse_plan(document), facts).items)
    async with AsyncExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        fleet = stack.enter_context(SimulatedFleet(",".join(["quad"] * 2 * vehicles)))
        natives = await stack.enter_async_context(instances(fleet.connections[vehicles:]))
        service = stack.enter_context(ServiceProcess(Path(folder) / "data", fleet.connections[:vehicles]))
        http = await stack.enter_async_context(aiohttp.ClientSession())
        dispatcher = Dispatcher(http, service.url)
        ours = {vehicle_id: Uploads(http, service.url) for vehicle_id in await dispatcher.until_vehicles(vehicles)}
        systems = [await found(instance) for instance in natives]
        plan = await dispatcher.post("/plans", document)
        if lossy:
            fleet.control("loss", LOSS)
            fleet.control("delay_s", DELAY_S)

        async def measure() -> Pair:
            ours_ms = [uploads.ms(plan["id"], vehicle_id) for vehicle_id, uploads in ours.items()]
            floors_ms = [floor_ms(system, wire) for system in systems]
            return Pair(fmean(await asyncio.gather(*ours_ms)), fmean(await asyncio.gather(*floors_ms)))

        await measure()
        yield measure


def row(items: int) -> Row:
    """On a link without losses."""
    return Row(
        name=f"upload-{items}",
        title=f"REST upload of {items} items, verified by its checksum",
        floor="mavsdk's upload alone, not verified",
        unit="ms",
        goal=Goal(1.10, "at most"),
        prepare=lambda scale: prepared(items),
        limited_by="for each item two turns of the link guard; for each upload the check of the plan and two commits",
        rounds=5,
    )


ROWS: Final = (
    row(10),
    row(100),
    row(500),
    Row(
        name="upload-loss",
        title="the same with 40 items while 5 % of the frames are lost each way, 20 ms delay: mean of 8",
        floor="mavsdk's uploads, each tried again until it succeeds",
        unit="ms",
        goal=Goal(1.0, "at most"),
        prepare=lambda scale: prepared(LOSSY_ITEMS, vehicles=LOSSY_VEHICLES, lossy=True),
        limited_by="the vehicle's time-out for each lost item; Waydrop clears an old fence and rally points first",
        rounds=5,
        long_rounds=25,
        version=2,
    ),
)
