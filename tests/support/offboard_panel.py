"""The Manual control panel as a pilot uses it, on a machine that may be too busy for it now and then."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any, Final

from playwright.async_api import FloatRect, Locator, expect
from playwright.async_api import TimeoutError as PageTimeout

from tests.support.dashboard import HOLD_MS, Dashboard

ATTEMPTS = 6
PRESS_MS = 10_000
"""Longer than a button needs that is there."""
SETTLE_MS = 30_000
NEWS_MS = 5_000
"""A busy page may still show a lease that the service has ended."""
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
        await self.dashboard.button("Take the lease of v1").click(timeout=SETTLE_MS)
        await expect(self.phase("leased")).to_be_visible()

    async def enter(self) -> None:
        """
        Manual control on. A page or a service that stood still for a second on a busy machine has lost the lease, or
        the entry is refused: then again.
        """
        problem: Exception | None = None
        for _ in range(ATTEMPTS):
            try:
                await self.take()
                await self.take_control()
            except (PageTimeout, AssertionError) as error:
                problem = error
            if await self.is_flying():
                return
            await self.let_go()
            await self.restore()
        raise AssertionError(f"no entry each time: {await self.panel.inner_text()}") from problem

    async def take_control(self) -> None:
        """With the lease: enter, and wait until that is done or refused, or the lease is lost."""
        await expect(self.dashboard.button("Take control of v1")).to_be_enabled()
        await self.press("Take control of v1", hold_ms=HOLD_MS)
        ended = self.phase("flying").or_(self.phase("off")).or_(self.refused_entry())
        await expect(ended).to_be_visible(timeout=SETTLE_MS)

    def refused_entry(self) -> Locator:
        """The panel with the lease still, and why there was no entry."""
        words = self.page.get_by_text("Take control of v1: refused")
        return self.phase("leased").filter(has=self.page.get_by_role("alert").filter(has=words))

    async def let_go(self) -> None:
        """No lease any more, whatever became of it."""
        await expect(self.phase("leased").or_(self.phase("off"))).to_be_visible(timeout=SETTLE_MS)
        if await self.phase("leased").is_visible():
            with suppress(PageTimeout):  # it may end at this moment
                await self.press("Release the lease")
        await expect(self.phase("off")).to_be_visible()

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
                if not await self._is_lost():
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
        """
        These steps, which take and enter by themselves. What fails once the lease is lost or the entry is refused is
        done all again.
        """
        for _ in range(ATTEMPTS):
            try:
                await steps()
            except (PageTimeout, AssertionError) as error:
                if not await self._is_lost():
                    await self._explain(error)
                    raise
                await self.let_go()
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
                if not await self._is_lost():
                    raise
            await expect(self.phase("off")).to_be_visible()
            if words in await self.panel.inner_text():
                return
            await self.page.keyboard.up("w")
            await self.restore()
        raise AssertionError(f"lost in another way each time: {await self.panel.inner_text()}")

    async def _is_lost(self) -> bool:
        """Whether manual control or the lease is lost, or the entry was refused."""
        try:
            await expect(self.phase("off").or_(self.refused_entry())).to_be_visible(timeout=NEWS_MS)
        except AssertionError:
            return False
        return True

    async def _explain(self, error: Exception) -> None:
        """Add what the panel says at the moment."""
        error.add_note(f"The panel says:\n{await self.panel.inner_text()}")
