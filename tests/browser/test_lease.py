"""The lease on the page: one page's at a time, offered, taken over, overridden; and what the page cannot fly."""

from __future__ import annotations

import json
import re
from contextlib import suppress

from playwright.async_api import Browser, expect
from playwright.async_api import TimeoutError as PageTimeout

from tests.support.accessibility import PHONE, violations
from tests.support.dashboard import HOLD_MS, Dashboard
from tests.support.offboard_panel import ATTEMPTS, PRESS_MS, SMALL, OffboardPanel
from tests.support.service_process import ServiceProcess


async def test_the_lease_is_one_pages_and_tells_before_an_entry_why_there_can_be_none(
    browser: Browser, idle_service: ServiceProcess
) -> None:
    async with (
        Dashboard.opened(browser, idle_service.url, **SMALL) as first,
        Dashboard.opened(browser, idle_service.url, **SMALL) as second,
    ):
        await lease_of_one_page(OffboardPanel(first), OffboardPanel(second))


async def lease_of_one_page(offboard: OffboardPanel, other: OffboardPanel) -> None:
    """The first has it, the second is told so, until the first is loaded anew."""
    page = offboard.page
    sent: list[str] = []
    page.on("websocket", lambda ws: ws.on("framesent", lambda payload: sent.append(str(payload))))
    await offboard.open()
    await offboard.panel.focus()
    await page.keyboard.press("w")
    await offboard.unless_lost(lambda: lease_without_entry(offboard))
    await offboard.panel.focus()
    await page.keyboard.press("w")

    await other.open()
    await lease_is_refused(offboard, other)
    for name, shown in (("with the lease", page), ("refused the lease", other.page)):
        assert await violations(shown, name, (PHONE,)) == []
    await lease_changes_holder(offboard, other)

    await page.reload()  # the lease ends with the page, and is not taken again by it
    await offboard.dashboard.until_live()
    await expect(offboard.phase("off")).to_be_visible()
    await expect(other.panel.locator(".offboard-holder")).to_contain_text("Nobody has the lease of v1")
    assert not any('"setpoint"' in frame for frame in sent), "keys without manual control mean nothing"


async def lease_without_entry(offboard: OffboardPanel) -> None:
    """Why there can be no entry is told with the lease already."""
    await offboard.take()
    await expect(offboard.panel.locator(".entry-reason")).to_contain_text("Vehicle v1 is not armed")
    await expect(offboard.panel.locator(".audit li.blocks")).to_contain_text("COM_OBL_RC_ACT")
    await expect(offboard.dashboard.button("Take control of v1")).to_be_disabled()


async def lease_is_refused(offboard: OffboardPanel, other: OffboardPanel) -> None:
    """While the first has it. If a busy machine has ended that lease meanwhile, the second gets it: then again."""
    refusal = other.panel.get_by_role("alert")
    for _ in range(ATTEMPTS):
        await lease_is_seen(offboard, other)
        await other.press("Take the lease of v1")
        try:
            await expect(refusal).to_contain_text("Wait until it ends, ask for a hand-over")
            await expect(refusal.locator("code")).to_have_text("offboard.lease_held")
        except AssertionError:
            if not await other.phase("leased").is_visible():
                raise
            await other.let_go()
        else:
            return
    raise AssertionError(f"lost each time: {await offboard.panel.inner_text()}")


async def lease_changes_holder(offboard: OffboardPanel, other: OffboardPanel) -> None:
    """Offered and taken, then overridden by an admin: each time one page has it, and the other says who took it."""
    for _ in range(ATTEMPTS):
        await lease_is_seen(offboard, other)
        try:
            if await offboard.panel.locator(".hand-over details[open]").count() == 0:  # else a click would close it
                await offboard.panel.get_by_text("Hand over v1").click(timeout=PRESS_MS)
            await offboard.panel.get_by_label("Recipient").fill("local", timeout=PRESS_MS)
            await offboard.press("Offer local the lease of v1", hold_ms=HOLD_MS)
            await other.press("Take over v1", hold_ms=HOLD_MS)
            await expect(other.phase("leased")).to_be_visible()
            await expect(offboard.panel).to_contain_text("Taken over by local.")
            await offboard.press("Override local's lease of v1", hold_ms=HOLD_MS)
            await expect(offboard.phase("leased")).to_be_visible()
            await expect(other.panel).to_contain_text("Taken over by local.")
        except (PageTimeout, AssertionError):
            with suppress(PageTimeout):  # each may be gone at this moment
                if await other.phase("leased").is_visible():
                    await other.press("Release the lease")
                if await offboard.dashboard.button("Withdraw the offer").is_visible():
                    await offboard.press("Withdraw the offer")
        else:
            return
    raise AssertionError(f"the lease never changed its holder: {await other.panel.inner_text()}")


async def lease_is_seen(offboard: OffboardPanel, other: OffboardPanel) -> None:
    """The first has the lease, and the second is told so. A service that stood still has ended it: then again."""
    for _ in range(ATTEMPTS):
        try:
            if await offboard.phase("off").is_visible():
                await offboard.take()
            await expect(other.panel.locator(".offboard-holder")).to_contain_text("local has the lease of v1")
        except (PageTimeout, AssertionError):
            await expect(offboard.phase("off")).to_be_visible()  # else the second was not told
        else:
            return
    raise AssertionError(f"lost each time: {await offboard.panel.inner_text()}")


async def by_keyboard(offboard: OffboardPanel, *names: str) -> None:
    """Press these buttons of the panel, each by Enter."""
    for name in names:
        await offboard.panel.get_by_role("button", name=name, exact=True).press("Enter", timeout=PRESS_MS)


async def queue_and_order(offboard: OffboardPanel) -> None:
    """A lease, two tasks in the middle of the map, their order changed, both taken out: without a mouse."""
    page, titles = offboard.page, offboard.panel.locator(".task b")
    await by_keyboard(offboard, "Take the lease of v3")
    await expect(offboard.phase("leased")).to_contain_text("Queue a task first")
    for kind, count in (("Circle", 1), ("Go to", 2)):
        await by_keyboard(offboard, kind, "Focus the map")
        await expect(page.locator(".map-canvas canvas")).to_be_focused()
        await page.keyboard.press("Space")
        await page.keyboard.press("Enter")
        await expect(titles).to_have_count(count)
    await expect(titles).to_have_text(["Circle, radius 80 m, clockwise", "Go to"])
    await by_keyboard(offboard, "Move task 2 up")
    await expect(titles).to_have_text(["Go to", "Circle, radius 80 m, clockwise"])
    await expect(offboard.panel.get_by_role("button", name="Move task 1 up")).to_be_focused()
    await expect(offboard.panel.locator(".after-last")).to_contain_text("v3 circles and waits for the next")
    await offboard.panel.focus()
    for key in ("w", "ArrowUp", "r"):
        await page.keyboard.press(key)
    await page.evaluate("window.dispatchEvent(new Event('blur'))")
    await by_keyboard(offboard, "Remove task 1")
    await expect(titles).to_have_count(1)  # what is done with is the task that is shown
    await by_keyboard(offboard, "Next task")
    await expect(titles).to_have_count(0)
    await by_keyboard(offboard, "Release the lease")
    await expect(offboard.phase("off")).to_be_visible()


async def test_a_wing_is_commanded_by_tasks_from_the_keyboard_alone_and_no_setpoint_is_sent(
    idle_page: Dashboard,
) -> None:
    offboard, page = OffboardPanel(idle_page), idle_page.page
    sent: list[str] = []
    page.on("websocket", lambda ws: ws.on("framesent", lambda payload: sent.append(str(payload))))
    await idle_page.vehicle("v3").click()
    await page.get_by_role("tab", name="Manual control").click()
    follows = page.get_by_role("region", name="What you can do with v3")
    await expect(follows.locator(".cannot")).to_have_text(
        [
            re.compile("Keys, sticks and gamepad: no.*PX4 does not follow it"),
            re.compile("Go to a point on the map: no.*send position and velocity"),
            re.compile("Attitude sticks: no.*a network may delay them"),
        ]
    )
    how = page.get_by_role("region", name="How v3 is controlled")
    await expect(how).to_contain_text("v3 is controlled by tasks only")
    await expect(how).to_contain_text("v3 holds at once and discards its other tasks")
    await offboard.unless_lost(lambda: queue_and_order(offboard))
    asked = {json.loads(frame)["type"] for frame in sent if '"type"' in frame}
    assert {"acquire_lease", "task", "move", "remove"} <= asked
    assert "setpoint" not in asked
