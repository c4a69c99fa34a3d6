"""The plan editor as its users use it."""

from __future__ import annotations

import json
from typing import Any

from playwright.async_api import Locator, expect

from tests.support.dashboard import Dashboard
from tests.support.service_process import until

SETTLED = """async () => {
  for (let frames = 0; frames < 2; frames += 1) await new Promise(requestAnimationFrame);
  const now = [...document.querySelectorAll('.grid-labels span')].map((label) => label.style.cssText).join();
  const before = window.labelsBefore;
  window.labelsBefore = now;
  return now !== '' && now === before;
}"""
"""True when the map's grid is where it was at the last look, and a moving map was drawn anew between the two."""


class Editor:
    """The items of a plan, and the map on which they are drawn."""

    def __init__(self, dashboard: Dashboard) -> None:
        self.dashboard = dashboard
        self.page = dashboard.page
        self.items = dashboard.page.locator(".plan-item")

    async def start_new(self) -> None:
        """A new plan, with the waypoint tool in hand, on a map that has come to rest."""
        await self.page.get_by_role("tab", name="Plan").click()
        await self.dashboard.button("New plan").click()
        await expect(self.items).to_have_count(2)
        await self.page.wait_for_function(SETTLED, polling=700)

    async def on_map(self, east_px: float, north_px: float) -> tuple[float, float]:
        """A place on the screen, from the middle of the map."""
        box = await self.page.locator(".map-canvas").bounding_box()
        assert box is not None
        return box["x"] + box["width"] / 2 + east_px, box["y"] + box["height"] / 2 - north_px

    async def draw(self, east_px: float, north_px: float) -> None:
        """Click there."""
        await self.page.mouse.click(*await self.on_map(east_px, north_px))

    async def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Take hold of what is there, as soon as the map has drawn it, and let it go somewhere else."""
        canvas = self.page.locator(".map-canvas canvas")

        async def hover() -> str:
            await self.page.mouse.move(start[0] + 30, start[1] + 30)
            await self.page.mouse.move(*start)
            return str(await canvas.evaluate("canvas => canvas.style.cursor"))

        await until(hover, lambda cursor: cursor != "", "the point must be drawn", 20)
        await self.page.mouse.down()
        await self.page.mouse.move(*end, steps=4)
        await self.page.mouse.up()

    def item(self, name: str) -> Locator:
        """The item with this id."""
        return self.page.locator(".plan-item").filter(has=self.page.get_by_text(name, exact=True))

    async def document(self) -> dict[str, Any]:
        """The plan as the JSON tab has it."""
        await self.page.get_by_role("tab", name="JSON").click()
        text = await self.page.get_by_label("Plan as JSON").input_value()
        await self.page.get_by_role("tab", name="Items").click()
        plan: dict[str, Any] = json.loads(text)
        return plan
