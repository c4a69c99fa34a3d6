"""The Manual control panel as a pilot uses it, on a machine that may be too busy for it now and then."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any, Final

from playwright.async_api import FloatRect, Locator, expect
from playwright.async_api import TimeoutError as PageTimeout

from tests.support.dashboard import Dashboard

ATTEMPTS = 6
PRESS_MS = 10_000
"""Longer than a button needs that is there."""
SMALL: Final[dict[str, Any]] = {"width": 360, "height": 800}
"""Software draws a small map fast: the page must not stand still, or the dead-man rightly acts."""


class OffboardPanel:
    """
    The Manual control panel of v1.

    `restore` brings the vehicle back to where the steps begin. After a loss on a busy machine they begin again, and
    until then the vehicle may have acted alone: returned, landed, disarmed.
    """

    def __init__(self, dashboard: Dashboard, restore: Callable[[], Awaitable[None]] | None = None) -> None:
        self.dashboard = dashboard
        self._restore = restore
        self.page = dashboard.page
        self.panel = dashboard.page.locator(".offboard")
        self.sent = self.panel.locator(".sent-words dd")
        self.views = dashboard.page.get_by_role("navigation", name="Views")

    async def open(self, vehicle_id: str = "v1") -> None:
        """Choose the vehicle and its panel, on a narrow page."""
        await self.views.get_by_role("button", name="Fleet").click()
        await self.dashboard.vehicle(vehicle_id).click()
        await self.views.get_by_role("button", name="Manual control").click()

    def phase(self, name: str) -> Locator:
        """The panel, while it is in this phase."""
        return self.page.locator(f'.offboard[data-phase="{name}"]')

    async def take(self) -> None:
        """The lease, and nothing more."""
        await self.dashboard.button("Take the lease of v1").click()
        await expect(self.phase("leased")).to_be_visible()

    async def enter(self) -> None:
        """Manual control on. A page that stood still for a second on a busy machine has lost its lease: then again."""
        for _ in range(ATTEMPTS):
            await self.take()
            await self.take_control()
            if await self.is_flying():
                return
            await self.restore()
        raise AssertionError(await self.panel.inner_text())

    async def take_control(self) -> None:
        """With the lease: enter, and wait until that is done, or the lease is lost."""
        await expect(self.dashboard.button("Take control of v1")).to_be_enabled()
        await self.dashboard.hold("Take control of v1")
        await expect(self.phase("flying").or_(self.phase("off"))).to_be_visible(timeout=30_000)

    async def restore(self) -> None:
        """The vehicle as the steps need it."""
        if self._restore is not None:
            await self._restore()

    async def is_flying(self) -> bool:
        """Whether manual control is still on."""
        return await self.panel.get_attribute("data-phase") == "flying"

    async def until_text(self, words: str) -> None:
        """Wait until this is really sent, with manual control still on."""
        seen = self.sent.filter(has_text=words)
        await expect(seen.or_(self.phase("off"))).to_be_visible(timeout=30_000)
        assert await self.is_flying(), await self.panel.inner_text()

    async def press(self, name: str, *, hold_ms: int = 0) -> None:
        """Press a button of the page or of its map."""
        await self.dashboard.button(name).click(delay=hold_ms, timeout=PRESS_MS)

    async def box(self, selector: str) -> FloatRect:
        """Where this is on the page."""
        found = await self.page.locator(selector).bounding_box(timeout=PRESS_MS)
        assert found is not None, selector
        return found

    async def fly(self, steps: Callable[[OffboardPanel], Awaitable[None]]) -> None:
        """
        Manual control on, and these steps without a loss. What fails while nobody flies any more proves nothing: a page
        that stood still on a busy machine has lost its lease. Then all again.
        """
        for _ in range(ATTEMPTS):
            if not await self.is_flying():
                await self.enter()
            try:
                await steps(self)
            except (PageTimeout, AssertionError) as error:
                if await self.is_flying():
                    await self._explain(error)
                    raise
            if await self.is_flying():
                return
            await self.page.keyboard.up("w")
            await self.page.mouse.up()
            await expect(self.phase("off")).to_be_visible()
            await self.restore()
        raise AssertionError(f"lost each time: {await self.panel.inner_text()}")

    async def unless_lost(self, steps: Callable[[], Awaitable[None]]) -> None:
        """These steps, which take and enter by themselves. What fails once the lease is lost is done all again."""
        for _ in range(ATTEMPTS):
            try:
                await steps()
            except (PageTimeout, AssertionError) as error:
                if await self.panel.get_attribute("data-phase") != "off":
                    await self._explain(error)
                    raise
                await self.restore()
            else:
                return
        raise AssertionError(f"lost each time: {await self.panel.inner_text()}")

    async def fly_until_lost(
        self, steps: Callable[[OffboardPanel], Awaitable[None]], lose: Callable[[], Awaitable[Any]], words: str
    ) -> None:
        """Fly these steps, then lose manual control in this way, which the panel says in these words."""
        for _ in range(ATTEMPTS):
            await self.fly(steps)
            try:
                await lose()
            except PageTimeout:
                if await self.is_flying():
                    raise
            await expect(self.phase("off")).to_be_visible()
            if words in await self.panel.inner_text():
                return
            await self.page.keyboard.up("w")
            await self.restore()
        raise AssertionError(f"lost in another way each time: {await self.panel.inner_text()}")

    async def _explain(self, error: Exception) -> None:
        """Add what the panel says at the moment."""
        error.add_note(f"The panel says:\n{await self.panel.inner_text()}")
