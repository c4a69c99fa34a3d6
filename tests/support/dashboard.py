"""The page as its users use it: by the names of its buttons, with a watch on its console and its requests."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any, Literal, Self

from playwright.async_api import Browser, ConsoleMessage, Locator, Page, Request, expect

from tests.support.paths import ROOT

CLINIC_RUN = (ROOT / "plans" / "clinic-run.json").read_text()

HOLD_MS = 1200
"""Longer than the page asks for."""
FLIGHT_MS = 180_000
"""More than a flight takes at the tests' speed on a busy machine."""
OPEN_MS = 120_000
"""It ends a hang: a busy machine may take a minute to find seven vehicles, or to draw a new page."""
PATIENCE_MS = 180_000
"""Software WebGL draws a 4K map slowly, the more so on a busy machine."""

Scheme = Literal["dark", "light"]

COARSE_MAP = "Object.defineProperty(window, 'devicePixelRatio', { get: () => 0.5 });"
"""Only the map asks for it. Software WebGL draws a fourth of the pixels; the page keeps all of its own."""

TAP = """async button => {
  for (const kind of ['pointerdown', 'pointerup'])
    button.dispatchEvent(new PointerEvent(kind, { bubbles: true, isPrimary: true, pointerId: 1 }));
  await new Promise(drawn => setTimeout(drawn));
  return button.textContent;
}"""

ALL_SEQS = """feed => feed.querySelector('.more') ? null
  : [...feed.querySelectorAll('.event')].map(row => Number(row.dataset.seq))"""

SOFTWARE_GL = "GPU stall due to ReadPixels"
"""What Chromium says when a canvas is copied without a graphics card; no fault of the page."""
GIVEN_UP = "WebSocket is closed before the connection is established"
"""What Chromium says when the page gives up a handshake that takes long, and begins another."""
SERVICE_LOST = ("WebSocket connection", "Failed to load resource: net::ERR_")
"""What Chromium says of a killed service: of the stream, and of a request that is refused, reset or left unanswered."""


def waiting_run(name: str = "Clinic run", *, hold_s: float = 600) -> str:
    """A plan whose vehicle waits at a waypoint, by itself for longer than any machine needs to command it there."""
    plan = json.loads(CLINIC_RUN)
    plan["name"] = name
    plan["items"][1]["hold_s"] = hold_s
    return json.dumps(plan)


def is_object(text: str) -> bool:
    """Whether this is a JSON object: the least that can be listed."""
    try:
        return isinstance(json.loads(text), dict)
    except ValueError:
        return False


class Dashboard:
    """One open page. `problems` collects what no test may see: console errors, exceptions, requests to other hosts."""

    def __init__(self, page: Page, url: str, vehicles: int = 4) -> None:
        self.page = page
        self.url = url
        self.vehicles = vehicles
        self.problems: list[str] = []
        self.tolerated: tuple[str, ...] = ()
        page.set_default_timeout(OPEN_MS)
        page.on("console", self._on_console)
        page.on("pageerror", lambda error: self.problems.append(f"exception: {error}"))
        page.on("request", self._on_request)

    @classmethod
    @asynccontextmanager
    async def opened(
        cls,
        browser: Browser,
        url: str,
        *,
        vehicles: int = 4,
        width: int = 1440,
        height: int = 900,
        scheme: Scheme = "dark",
        fine_map: bool = False,
    ) -> AsyncIterator[Self]:
        """A page that is live and shows all its vehicles; at the end it must have had no problems.

        `fine_map`: its map is drawn in full, for a test of what is thinner than two pixels.
        """
        context = await browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme)
        if not fine_map:
            await context.add_init_script(COARSE_MAP)
        dashboard = cls(await context.new_page(), url, vehicles)
        try:
            await dashboard.open()
            yield dashboard
        finally:  # a page that a failed test left open would make the next ones slow
            await context.close()
        assert dashboard.problems == [], dashboard.problems

    async def open(self) -> None:
        """Load the page and wait for the stream and the whole fleet."""
        await self.page.goto(self.url)
        await self.until_live()
        await expect(self.page.locator(".vehicle")).to_have_count(self.vehicles, timeout=OPEN_MS)

    async def until_live(self) -> None:
        """Wait until the stream is open."""
        await expect(self.page.locator(".connection.live")).to_be_visible(timeout=OPEN_MS)

    def button(self, name: str) -> Locator:
        """A button by its name."""
        return self.page.get_by_role("button", name=name)

    def vehicle(self, vehicle_id: str) -> Locator:
        """The row of a vehicle in the fleet list."""
        return self.page.get_by_role("region", name="Fleet").get_by_role("button", name=vehicle_id)

    async def write_plan(self, text: str) -> None:
        """Paste a plan into the plan panel; its items are shown if it has any."""
        await self.page.get_by_role("tab", name="Plan").click()
        await self.fill_plan(text)

    async def fill_plan(self, text: str) -> None:
        """Paste a plan into the panel that is open."""
        await self.page.get_by_role("tab", name="JSON").click()
        await self.page.get_by_label("Plan as JSON").fill(text)
        items = self.page.get_by_role("tab", name="Items")
        if is_object(text):
            await items.click()
        else:
            await expect(items).to_be_disabled()

    async def upload(self, text: str, vehicle_id: str) -> None:
        """Paste a plan, choose the vehicle, upload, and wait until the run can be started."""
        await self.write_plan(text)
        await self.page.locator(".send").get_by_label("Vehicle").select_option(vehicle_id)
        await expect(self.page.get_by_text("Can be flown")).to_be_visible(timeout=20_000)
        await self.button(f"Upload to {vehicle_id}").click()
        await self.until_state("uploaded")

    async def until_next(self, words: str) -> None:
        """Wait until exactly this is the next thing to do."""
        await expect(self.page.locator(".primary:visible")).to_have_text([words])

    async def tap(self, name: str) -> str:
        """
        Press a button and let go at once, by the clock of its events: a busy page makes a held one of a click. Returns
        what it says then, which is soon gone.
        """
        return str(await self.button(name).evaluate(TAP))

    async def hold(self, name: str) -> None:
        """Hold a button until it is confirmed."""
        await self.button(name).click(delay=HOLD_MS)

    async def hold_while(self, name: str, meanwhile: Callable[[], Awaitable[object]]) -> None:
        """Hold a button, the pointer at its middle, until it is confirmed or `meanwhile` interrupts it."""
        await self.button(name).hover()
        await self.page.mouse.down()
        await meanwhile()
        await self.page.wait_for_timeout(HOLD_MS)
        await self.page.mouse.up()

    async def until_state(self, *states: str) -> None:
        """Wait until the shown run is in one of these states."""
        selector = ", ".join(f'.run-head[data-state="{state}"]' for state in states)
        await expect(self.page.locator(selector)).to_be_visible(timeout=FLIGHT_MS)

    async def run_id(self) -> str | None:
        """The run that is shown."""
        return await self.page.locator(".run-head").get_attribute("data-run")

    async def filter_events(self, name: str) -> None:
        """Choose what the feed shows."""
        await self.page.get_by_label("Filter events").select_option(name)

    async def feed_seqs(self) -> list[int]:
        """The numbers of all events in the feed, newest first. The feed goes on showing all of them."""
        await self.filter_events("All events")
        while True:  # rows and button are read at once: an event that comes between them would hide the oldest row
            seqs: list[int] | None = await self.page.locator(".feed").evaluate(ALL_SEQS)
            if seqs is not None:
                return seqs
            await self.button("Show older events").click()

    async def shown_seqs(self) -> list[int]:
        """The numbers of the events that the feed shows now."""
        seqs: list[Any] = await self.page.locator(".event").evaluate_all("rows => rows.map(r => Number(r.dataset.seq))")
        return [int(seq) for seq in seqs]

    def _on_console(self, message: ConsoleMessage) -> None:
        tolerated = (SOFTWARE_GL, GIVEN_UP, *self.tolerated)
        if message.type in ("error", "warning") and not any(part in message.text for part in tolerated):
            self.problems.append(f"console {message.type}: {message.text}")

    def _on_request(self, request: Request) -> None:
        if not request.url.startswith((self.url, self.url.replace("http", "ws", 1), "data:", "blob:")):
            self.problems.append(f"request to another host: {request.url}")
