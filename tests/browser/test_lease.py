"""The lease on the page: one page's at a time, offered, taken over, overridden; and what the page cannot fly."""

from __future__ import annotations

import re

from playwright.async_api import Browser, expect
from playwright.async_api import TimeoutError as PageTimeout

from tests.browser.cockpit import ATTEMPTS, PRESS_MS, SMALL, Cockpit
from tests.browser.dashboard import HOLD_MS, Dashboard
from tests.service import ServiceProcess


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
    await lease_changes_hands(cockpit, other)

    await page.reload()  # the lease ends with the page, and is not taken again by it
    await cockpit.dashboard.until_live()
    await expect(cockpit.phase("off")).to_be_visible()
    await expect(other.panel.locator(".hands-holder")).to_contain_text("Nobody has the lease of v1")
    assert not any('"setpoint"' in frame for frame in sent), "keys without hands on mean nothing"


async def lease_changes_hands(cockpit: Cockpit, other: Cockpit) -> None:
    """Offered and taken, then overridden by an admin: each time one page has it, and the other says who took it."""
    for _ in range(ATTEMPTS):
        await lease_is_seen(cockpit, other)
        try:
            await cockpit.panel.get_by_text("Hand v1 over").click(timeout=PRESS_MS)
            await cockpit.panel.get_by_label("To whom").fill("local")
            await cockpit.press("Offer local the lease of v1", hold_ms=HOLD_MS)
            await other.press("Take over v1", hold_ms=HOLD_MS)
            await expect(other.phase("leased")).to_be_visible()
            await expect(cockpit.panel).to_contain_text("Taken over by local.")
            await cockpit.press("Override local's lease of v1", hold_ms=HOLD_MS)
            await expect(cockpit.phase("leased")).to_be_visible()
            await expect(other.panel).to_contain_text("Taken over by local.")
        except (PageTimeout, AssertionError):
            if await other.panel.get_attribute("data-phase") == "leased":
                await other.press("Give the lease back")
        else:
            return
    raise AssertionError(f"never changed hands: {await other.panel.inner_text()}")


async def lease_is_seen(cockpit: Cockpit, other: Cockpit) -> None:
    """The first has the lease, and the second is told so. A service that stood still has ended it: then again."""
    for _ in range(ATTEMPTS):
        if await cockpit.panel.get_attribute("data-phase") == "off":
            await cockpit.take()
        try:
            await expect(other.panel.locator(".hands-holder")).to_contain_text("local has the lease of v1")
        except AssertionError:
            await expect(cockpit.phase("off")).to_be_visible()  # else the second was not told
        else:
            return
    raise AssertionError(f"lost each time: {await cockpit.panel.inner_text()}")


async def test_what_the_page_cannot_fly_is_said_with_the_reason(idle_page: Dashboard) -> None:
    await idle_page.vehicle("v3").click()
    await idle_page.page.get_by_role("tab", name="Hands on").click()
    follows = idle_page.page.get_by_role("region", name="What v3 follows")
    await expect(follows.locator(".cannot")).to_have_text(
        [
            re.compile("Keys, sticks and gamepad: no.*PX4 does not follow it"),
            re.compile("Go to a place by a click: no.*give position and velocity"),
            re.compile("Attitude sticks: no.*late over a network"),
        ]
    )
    await expect(idle_page.button("Take the lease of v3")).to_be_disabled()
