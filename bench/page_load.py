"""What 200 vehicles at 10 Hz cost the page's main thread, and that none of their states is dropped.

Usage: python -m bench.page_load [--vehicles 200] [--hz 10] [--seconds 20] [--page FOLDER] [--profile FILE]

The real application with vehicles made of a few lines, the real websocket, and Debian's Chromium with the built page
(`make`) on the view that shows fleet and map; `page_watch` says what is measured. The floor is the same page with the
same frames in which nothing moves. At the end every vehicle gets a state of its own in one tick, and every row of the
page must show what the API says; no event may be missing between the first and the last on the page's socket. The map
is drawn in software here, in another process. While they move, no task of the main thread may take longer than 100 ms.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import math
import os
import sys
import tempfile
from collections.abc import AsyncIterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from playwright.async_api import Page, WebSocket, async_playwright, expect

from app.domain.vehicle.state import FlightMode, LandedState
from bench.page_watch import WATCH, measure, print_costs
from tests.browser.conftest import CHROMIUM, chromium_args
from tests.support.fake_links import HOME, FakeLink
from tests.support.paths import ROOT
from tests.support.service_in_process import SETTINGS, Service, run_service

DIST: Final = ROOT / "web" / "dist"
LONGEST_MS: Final = 100.0
MODES: Final = (FlightMode.MISSION, FlightMode.HOLD, FlightMode.RETURN)
ROWS: Final = """() => Object.fromEntries([...document.querySelectorAll('.vehicle')].map(row => [
  row.querySelector('.vehicle-name b').textContent,
  [...row.querySelectorAll('.badge:last-child, .battery, .landed')].map(part => part.textContent.trim()),
]))"""
LANDED: Final = {"in_air": "In the air", "on_ground": "Armed", "landing": "Landing"}


class Socket:
    """What arrives at the page's socket: the sizes of telemetry frames, and the numbers of the events."""

    def __init__(self, page: Page) -> None:
        self.telemetry: list[int] = []
        self.seqs: list[int] = []
        page.on("websocket", self._listen)

    def _listen(self, socket: WebSocket) -> None:
        socket.on("framereceived", lambda payload: self._take(str(payload)))

    def _take(self, text: str) -> None:
        if text.startswith('{"type":"telemetry"'):
            self.telemetry.append(len(text))
        elif text.startswith('{"type":"event"'):
            self.seqs.append(int(json.loads(text)["event"]["seq"]))


@contextlib.asynccontextmanager
async def moving(links: Sequence[FakeLink], hz: float) -> AsyncIterator[None]:
    """All vehicles fly circles, and each second some of them change their mode, which is an event."""
    task = asyncio.create_task(_move(links, hz))
    yield
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


async def _move(links: Sequence[FakeLink], hz: float) -> None:
    tick = 0
    while True:
        for number, link in enumerate(links):
            link.move(**_on_circle(number, tick / hz))
            if tick % 10 == 0 and number % 40 == (tick // 10) % 40:
                link.change(mode=MODES[(tick // 10) % len(MODES)])
        tick += 1
        await asyncio.sleep(1 / hz)


def _on_circle(number: int, at_s: float) -> dict[str, float]:
    radius_m, speed_m_s = 50.0 + 5.0 * number, 8.0
    angle = number + at_s * speed_m_s / radius_m
    return {
        "latitude_deg": HOME.latitude_deg + radius_m * math.cos(angle) / 111_195.0,
        "longitude_deg": HOME.longitude_deg + radius_m * math.sin(angle) / 75_000.0,
        "relative_altitude_m": 30.0 + number / 10.0 + math.sin(at_s),
        "velocity_north_m_s": -speed_m_s * math.sin(angle),
        "velocity_east_m_s": speed_m_s * math.cos(angle),
        "heading_deg": math.degrees(angle + math.pi / 2) % 360.0,
        "battery_percent": 90.0 - at_s / 10.0,
    }


def end_apart(links: Sequence[FakeLink]) -> None:
    """A last state for each that no other has, all at once."""
    for number, link in enumerate(links):
        landed = (LandedState.IN_AIR, LandedState.ON_GROUND, LandedState.LANDING)[number // 3 % 3]
        link.change(mode=MODES[number % 3], battery_percent=float(number % 97), landed=landed)


async def compare(page: Page, service: Service) -> list[str]:
    """Vehicles whose row is not what the API says, when nothing more comes."""
    _, _, answer = await service.call("GET", "/api/v1/vehicles")
    wanted = {one["id"]: _row(one["state"]) for one in answer["vehicles"]}
    for _ in range(100):
        shown: dict[str, Any] = await page.evaluate(ROWS)
        wrong = [name for name, row in wanted.items() if shown.get(name) != row]
        if not wrong and len(shown) == len(wanted):
            return []
        await asyncio.sleep(0.1)
    return wrong or ["rows of vehicles that are not there"]


async def has_arrived(socket: Socket, service: Service) -> bool:
    """Whether the journal's last event comes to the page, within a while."""
    for _ in range(100):
        if socket.seqs[-1] == service.services.journal.last_seq:
            return True
        await asyncio.sleep(0.1)
    return False


def _row(state: dict[str, Any]) -> list[str]:
    return [state["mode"].capitalize(), LANDED[state["landed"]], f"{state['battery_percent']:.0f}%"]


@contextlib.asynccontextmanager
async def served(folder: Path, dist: Path, vehicles: int, hz: float) -> AsyncIterator[Service]:
    """The application with the page and so many vehicles, told so often."""
    settings = replace(SETTINGS, web_root=dist, telemetry_period_s=1 / hz)
    async with run_service(folder, settings=settings, links=vehicles) as service:
        for link in service.links:
            link.change(armed=True, landed=LandedState.IN_AIR)
        yield service


async def bench(dist: Path, vehicles: int, hz: float, seconds: float, profile: Path | None) -> bool:
    """Print what was measured; False if a state was dropped, or a task held the main thread for too long."""
    with tempfile.TemporaryDirectory() as folder:
        async with served(Path(folder), dist, vehicles, hz) as service, async_playwright() as playwright:
            browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=chromium_args())
            page = await browser.new_page(viewport={"width": 1440, "height": 900})
            await page.add_init_script(WATCH)
            socket = Socket(page)
            cdp = await page.context.new_cdp_session(page)
            await cdp.send("Performance.enable")
            await page.goto(service.url)
            await expect(page.locator(".vehicle")).to_have_count(vehicles, timeout=60_000)
            costs = [await measure("nothing moves", page, cdp, socket.telemetry, seconds / 2)]
            async with moving(service.links, hz):
                await asyncio.sleep(2.0)
                if profile is not None:
                    await cdp.send("Profiler.enable")
                    await cdp.send("Profiler.start")
                costs.append(await measure(f"{vehicles} move", page, cdp, socket.telemetry, seconds))
                if profile is not None:
                    found = await cdp.send("Profiler.stop")
                    profile.write_text(json.dumps(found["profile"]))  # noqa: ASYNC240 nothing is measured any more
            end_apart(service.links)
            wrong = await compare(page, service)
            missed = not await has_arrived(socket, service)
            gaps = [seq for before, seq in zip(socket.seqs, socket.seqs[1:], strict=False) if seq > before + 1]
            await browser.close()
    out = sys.stdout.write
    out(f"load of the machine {os.getloadavg()[0]:.1f}\n")
    print_costs(costs)
    out(f"events: {len(socket.seqs)}, holes {len(gaps)}, the last one {'missing' if missed else 'there'}\n")
    out(f"vehicles whose row is not what the API says: {', '.join(wrong) or 'none'}\n")
    return not (wrong or gaps or missed) and max(costs[-1].long_tasks_ms, default=0.0) <= LONGEST_MS


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--vehicles", type=int, default=200)
    parser.add_argument("--hz", type=float, default=10.0)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--page", type=Path, default=DIST, help="folder of the built page")
    parser.add_argument("--profile", type=Path, help="write a CPU profile of the moving part")
    arguments = parser.parse_args()
    if not (arguments.page / "index.html").exists():
        sys.exit("the page is not built: make")
    if not asyncio.run(bench(arguments.page, arguments.vehicles, arguments.hz, arguments.seconds, arguments.profile)):
        sys.exit(f"a state was dropped, or a task took longer than {LONGEST_MS:g} ms")


if __name__ == "__main__":
    main()
