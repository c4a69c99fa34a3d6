"""The worker process of the real service ends with it, however that ends."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import aiohttp
import pytest

from app.services.plan_work import LARGE_ENTRIES
from tests.support.paths import PLANS
from tests.support.service_in_process import until
from tests.support.service_process import Dispatcher, ServiceProcess
from tests.support.simulated import free_udp_ports
from tests.support.workers import is_there, workers_of


def large_plan() -> dict[str, Any]:
    plan: dict[str, Any] = json.loads((PLANS / "clinic-run.json").read_text(encoding="utf-8"))
    first = next(place for place, item in enumerate(plan["items"]) if item["type"] == "waypoint")
    more = [{**plan["items"][first], "id": f"more-{number}"} for number in range(LARGE_ENTRIES)]
    return {**plan, "items": [*plan["items"][:first], *more, *plan["items"][first:]]}


@pytest.mark.parametrize("killed", [False, True], ids=["Ctrl-C", "kill -9"])
async def test_no_process_is_left_over(tmp_path: Path, http: aiohttp.ClientSession, *, killed: bool) -> None:
    with ServiceProcess(tmp_path, [f"udpin://127.0.0.1:{free_udp_ports(1)}"]) as service:
        checked = await Dispatcher(http, service.url).post("/plan-checks", {"plan": large_plan()})
        assert checked["timeline"] is not None
        (worker,) = workers_of(service.pid)
        if killed:
            service.kill()
        else:
            service.stop()
        await until(lambda: not is_there(worker))
        assert "Traceback" not in service.log()
        assert "worker process is lost" not in service.log()
