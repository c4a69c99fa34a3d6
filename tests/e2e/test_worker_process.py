"""The worker process of the real service ends with it, however that ends."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import aiohttp
import pytest

from app.services.plan_work import LARGE_ENTRIES
from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher, ServiceProcess, until
from tests.support.simulated import free_udp_ports
from tests.support.workers import is_there, workers_of

ANSWER_S = 120.0
"""A worker that has not answered within 30 s is given up, and the service does its work."""


def large_plan() -> dict[str, Any]:
    plan: dict[str, Any] = json.loads((PLANS / "clinic-run.json").read_text(encoding="utf-8"))
    first = next(place for place, item in enumerate(plan["items"]) if item["type"] == "waypoint")
    more = [{**plan["items"][first], "id": f"more-{number}"} for number in range(LARGE_ENTRIES)]
    return {**plan, "items": [*plan["items"][:first], *more, *plan["items"][first:]]}


async def worker_of(service: ServiceProcess) -> int:
    """The process that has checked a large plan. The next check starts one if it was given up."""
    async with aiohttp.ClientSession(timeout=aiohttp.ClientTimeout(total=ANSWER_S)) as http:

        async def workers() -> list[int]:
            checked = await Dispatcher(http, service.url).post("/plan-checks", {"plan": large_plan()})
            assert checked["timeline"] is not None
            return workers_of(service.pid)

        found: list[int] = await until(workers, lambda pids: len(pids) == 1, "one must do the work", ANSWER_S)
    return found[0]


@pytest.mark.parametrize("killed", [False, True], ids=["Ctrl-C", "kill -9"])
async def test_no_process_is_left_over(tmp_path: Path, *, killed: bool) -> None:
    with ServiceProcess(tmp_path, [f"udpin://127.0.0.1:{free_udp_ports(1)}"]) as service:
        worker = await worker_of(service)
        before = len(service.log_path.read_text())
        if killed:
            service.kill()
        else:
            service.stop()

        async def is_left_over() -> bool:
            return is_there(worker)

        await until(is_left_over, lambda left: not left, "it must end", 15.0)
        said = service.log_path.read_text()[before:]
        assert "Traceback" not in said
        assert "worker process is lost" not in said
