"""The loop of the real service is watched from its start: what stands still is told."""

from __future__ import annotations

import asyncio
import os
import signal
from pathlib import Path

import aiohttp

from tests.support.service_process import Dispatcher, ServiceProcess, until
from tests.support.simulated import free_udp_ports


async def test_a_service_that_stood_still_says_so(tmp_path: Path, http: aiohttp.ClientSession) -> None:
    with ServiceProcess(tmp_path, [f"udpin://127.0.0.1:{free_udp_ports(1)}"]) as service:
        os.kill(service.pid, signal.SIGSTOP)
        await asyncio.sleep(1.0)
        os.kill(service.pid, signal.SIGCONT)
        dispatcher = Dispatcher(http, service.url)

        async def longest_s() -> float:
            events = (await dispatcher.get("/events?limit=500"))["events"]
            return max([e["data"]["delay_s"] for e in events if e["kind"] == "service.loop_stalled"], default=0.0)

        await until(longest_s, lambda delay_s: delay_s > 0.5, "the journal must tell the stall", 30.0)
        async with http.get(f"{service.url}/metrics") as answer:
            assert "waydrop_loop_delay_seconds_count" in await answer.text()
