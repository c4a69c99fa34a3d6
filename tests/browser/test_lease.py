"""The lease on the page: one page's at a time, offered, taken over, overridden; and what the page cannot fly."""

from __future__ import annotations

import json
import re

from playwright.async_api import Browser, expect
from playwright.async_api import TimeoutError as PageTimeout

from tests.support.accessibility import TELEPHONE, violations
from tests.support.dashboard import HOLD_MS, Dashboard
from tests.support.offboard_panel import ATTEMPTS, PRESS_MS, SMALL, Cockpit
from tests.support.service_process import ServiceProcess


async def test_the_lease_is_one_pages_and_tells_before_an_entry_why_there_can_be_none(
    browser: Browser, idle_service: ServiceProcess
) -> None:
    async with (
        Dashboard.opened(browser, idle_service.url, **SMALL) as first,
        Dashboard.opened(browser, idle_service.url, **SMALL) as second,
    ):
        await lease_of_one_page(Cockpit(first), Cockpit(second))


async def lease_of_one_page(cockpit: Cockpit, other: Cockpit) -> None:
    """The first has it, the second is told so, until the first is loaded anew."""
    page, second = cockpit.page, other.dashboard
    sent: list[str] = []
    page.on("websocket", lambda ws: ws.on("framesent", lambda payload: sent.append(str(payload))))
    await cockpit.open()
    await cockpit.panel.focus()
    await page.keyboard.press("w")
    await cockpit.take()
    await expect(cockpit.panel.locator(".entry-reason")).to_contain_text("Vehicle v1 is not armed")
    await expect(cockpit.panel.locator(".audit li.blocks")).to_contain_text("COM_OBL_RC_ACT")
    await expect(cockpit.dashboard.button("Take control of v1")).to_be_disabled()
    await cockpit.panel.focus()
    await page.keyboard.press("w")

    await other.open()
    await lease_is_seen(cockpit, other)
    await second.button("Take the lease of v1").click()
    refusal = other.panel.get_by_role("alert")
    await expect(refusal).to_contain_text("Wait until it ends, ask for a hand-over")
    await expect(refusal.locator("code")).to_have_text("offboard.lease_held")
    for name, shown in (("with the lease", page), ("refused the lease", second.page)):
        assert await violations(shown, name, (TELEPHONE,)) == []
    await lease_changes_holder(cockpit, other)

    await page.reload()  # the lease ends with the page, and is not taken again by it
    await cockpit.dashboard.until_live()
    await expect(cockpit.phase("off")).to_be_visible()
    await expect(other.panel.locator(".offboard-holder")).to_contain_text("Nobody has the lease of v1")
    assert not any('"setpoint"' in frame for frame in sent), "keys without manual control mean nothing"


async def lease_changes_holder(cockpit: Cockpit, other: Cockpit) -> None:
    """Offered and taken, then overridden by an admin: each time one page has it, and the other says who took it."""
    for _ in range(ATTEMPTS):
        await lease_is_seen(cockpit, other)
        try:
            await cockpit.panel.get_by_text("Hand over v1").click(timeout=PRESS_MS)
            await cockpit.panel.get_by_label("Recipient").fill("local")
            await cockpit.press("Offer local the lease of v1", hold_ms=HOLD_MS)
            await other.press("Take over v1", hold_ms=HOLD_MS)
            await expect(other.phase("leased")).to_be_visible()
            await expect(cockpit.panel).to_contain_text("Taken over by local.")
            await cockpit.press("Override local's lease of v1", hold_ms=HOLD_MS)
            await expect(cockpit.phase("leased")).to_be_visible()
            await expect(other.panel).to_contain_text("Taken over by local.")
        except (PageTimeout, AssertionError):
            if await other.panel.get_attribute("data-phase") == "leased":
                await other.press("Release the lease")
        else:
            return
    raise AssertionError(f"the lease never changed its holder: {await other.panel.inner_text()}")


async def lease_is_seen(cockpit: Cockpit, other: Cockpit) -> None:
    """The first has the lease, and the second is told so. A service that stood still has ended it: then again."""
    for _ in range(ATTEMPTS):
        if await cockpit.panel.get_attribute("data-phase") == "off":
            await cockpit.take()
        try:
            await expect(other.panel.locator(".offboard-holder")).to_contain_text("local has the lease of v1")
        except AssertionError:
            await expect(cockpit.phase("off")).to_be_visible()  # else the second was not told
        else:
            return
    raise AssertionError(f"lost each time: {await cockpit.panel.inner_text()}")


async def by_keyboard(cockpit: Cockpit, *names: str) -> None:
    """Press these buttons of the panel, each by Enter."""
    for name in names:
        await cockpit.panel.get_by_role("button", name=name, exact=True).press("Enter", timeout=PRESS_MS)


async def queue_and_order(cockpit: Cockpit) -> None:
    """A lease, two tasks in the middle of the map, their order changed, both taken out: without a mouse."""
    page, titles = cockpit.page, cockpit.panel.locator(".task b")
    await by_keyboard(cockpit, "Take the lease of v3")
    await expect(cockpit.phase("leased")).to_contain_text("Queue a task first")
    for kind, count in (("Circle", 1), ("Go to", 2)):
        await by_keyboard(cockpit, kind, "Focus the map")
        await expect(page.locator(".map-canvas canvas")).to_be_focused()
        await page.keyboard.press("Space")
        await page.keyboard.press("Enter")
        await expect(titles).to_have_count(count)
    await expect(titles).to_have_text(["Circle, radius 80 m, clockwise", "Go to"])
    await by_keyboard(cockpit, "Move task 2 up")
    await expect(titles).to_have_text(["Go to", "Circle, radius 80 m, clockwise"])
    await expect(cockpit.panel.get_by_role("button", name="Move task 1 up")).to_be_focused()
    await expect(cockpit.panel.locator(".after-last")).to_contain_text("v3 circles and waits for the next")
    await cockpit.panel.focus()
    for key in ("w", "ArrowUp", "r"):
        await page.keyboard.press(key)
    await page.evaluate("window.dispatchEvent(new Event('blur'))")
    await by_keyboard(cockpit, "Remove task 1")
    await expect(titles).to_have_count(1)  # what is done with is the task that is shown
    await by_keyboard(cockpit, "Next task")
    await expect(titles).to_have_count(0)
    await by_keyboard(cockpit, "Release the lease")
    await expect(cockpit.phase("off")).to_be_visible()


async def test_a_wing_is_commanded_by_tasks_from_the_keyboard_alone_and_no_setpoint_is_sent(
    idle_page: Dashboard,
) -> None:
    cockpit, page = Cockpit(idle_page), idle_page.page
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
    await cockpit.unless_lost(lambda: queue_and_order(cockpit))
    asked = {json.loads(frame)["type"] for frame in sent if '"type"' in frame}
    assert {"acquire_lease", "task", "move", "remove"} <= asked
    assert "setpoint" not in asked
