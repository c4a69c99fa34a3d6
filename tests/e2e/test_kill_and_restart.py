"""kill -9 in mid-flight: the vehicle flies on, the next process takes the run up, and nobody misses an event."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import aiohttp

from app.domain.flight.recording import from_text, replay
from app.domain.run.run import Run
from app.storage import open_flight_log, verify_journal
from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher, ServiceProcess
from tests.support.simulated import SimulatedFleet

PLAN = json.loads((PLANS / "clinic-run.json").read_text())
for _item in PLAN["items"]:
    if _item["type"] == "gripper":
        _item["hold_s"] = 300.0  # on a busy machine a restart may take long; a release ends the hold at once
FLIGHT_S = 180.0


class Watcher:
    """A client that connects again with after= the last event it saw."""

    def __init__(self, http: aiohttp.ClientSession, url: str) -> None:
        self._http = http
        self._url = url
        self.seqs: list[int] = []
        self.run: dict[str, Any] = {}

    async def watch(self, until_kind: str, **fields: Any) -> None:
        """Take events in until one of this kind with these data comes."""
        after = self.seqs[-1] if self.seqs else 0
        async with (
            asyncio.timeout(FLIGHT_S),
            self._http.ws_connect(f"{self._url}/api/v1/stream?after={after}") as socket,
        ):
            async for message in socket:
                frame = json.loads(message.data)
                if frame["type"] != "event":
                    continue
                event = frame["event"]
                self.seqs.append(event["seq"])
                data = event["data"]
                if event["kind"] == until_kind and all(data.get(name) == value for name, value in fields.items()):
                    return
        raise AssertionError(f"the stream ended before {until_kind} {fields}")


async def test_a_killed_service_takes_its_run_up_and_the_stream_has_no_gap(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    with SimulatedFleet("quad", speed=4.0) as simulated, ServiceProcess(tmp_path, simulated.connections) as service:
        dispatcher, watcher = Dispatcher(http, service.url), Watcher(http, service.url)
        await dispatcher.until_vehicles(1)
        run_id = await dispatcher.fly(PLAN, "v1")
        await watcher.watch("run.item", phase="current", item_id="corner")
        service.kill()
        service.start()
        await watcher.watch("run.changed", state="completed")
        run = await dispatcher.get(f"/runs/{run_id}")
        assert run["drops"][0]["outcome"] == "released"
        assert run["flown_item_ids"] == ["takeoff", "corner", "clinic", "drop", "home"]
        assert watcher.seqs == list(range(1, len(watcher.seqs) + 1)), "every event once, in order, without a gap"
    found = await verify_journal(tmp_path / "waydrop.db")
    assert found.alterations == [], "what a kill leaves is still as it was written"
    assert found.heads[found.journal].seq >= watcher.seqs[-1]
    async with open_flight_log(tmp_path / "waydrop.db") as flights:
        again = replay(from_text(await flights.read(run["id"])))
    assert again.inputs > 100
    assert (again.differences, again.run) == ((), Run.model_validate(run)), "both parts are decided again as they were"


async def test_ctrl_c_ends_it_soon_and_the_flight_is_taken_up(tmp_path: Path, http: aiohttp.ClientSession) -> None:
    with SimulatedFleet("quad", speed=4.0) as simulated, ServiceProcess(tmp_path, simulated.connections) as service:
        dispatcher = Dispatcher(http, service.url)
        await dispatcher.until_vehicles(1)
        run_id = await dispatcher.fly(PLAN, "v1")
        await dispatcher.until_run(run_id, lambda run: run["state"] == "flying", "it must fly", 30)
        service.stop()  # fails if that takes too long
        service.start()
        run = await dispatcher.until_over(run_id, FLIGHT_S)
        assert run["state"] in ("completed", "aborted"), run["reason"]
        assert run["drops"][0]["outcome"] in ("released", "kept")
