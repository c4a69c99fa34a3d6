"""Faults from the page: a cut link is seen and healed, a refusal is told, a viewer may only look; and a late start."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

from playwright.async_api import Browser, Locator, Route, expect
from playwright.async_api import TimeoutError as PageTimeout

from app.api.principal import PrincipalView
from app.services.access import Role
from tests.browser.conftest import simulated_service
from tests.support.dashboard import Dashboard
from tests.support.simulated import SimulatedFleet

LINK_MS = 30_000
SET_MS = 10_000
ATTEMPTS = 6


def fault(dashboard: Dashboard, name: str) -> Locator:
    """The row of a fault."""
    return dashboard.page.locator(f'.fault[data-fault="{name}"]')


async def test_faults_are_set_seen_on_the_fleet_cleared_and_refused(browser: Browser, tmp_path: Path) -> None:
    with SimulatedFleet("quad,quad") as fleet, simulated_service(tmp_path, fleet) as service:
        async with Dashboard.opened(browser, service.url, vehicles=2) as dashboard:
            # Chromium writes each refused request into its console, and each that a busy simulator did not answer
            dashboard.tolerated = ("status of 4", "status of 504")
            await dashboard.page.get_by_role("tab", name="Simulator").click()
            await dashboard.page.locator(".sim-vehicle", has_text="v2").get_by_role("button").first.click()
            await cut_and_heal_the_link(dashboard)

            loss = fault(dashboard, "loss")
            for value, words in (("7", "must be at most 1, not 7"), ("0.05", "Now 0.05")):
                await until_shown(partial(set_value, loss, "Loss", value), loss.get_by_text(words))

            fast = dashboard.page.get_by_role("button", name="10 times real time")
            slow_only = dashboard.page.locator(".sim-speed-now", has_text="refused above 4")
            await until_shown(partial(fast.click, timeout=SET_MS), slow_only)

            winch = fault(dashboard, "stuck_winch")
            refusal = winch.get_by_role("alert").filter(has_text="winch")
            await until_shown(partial(winch.get_by_role("switch").click, timeout=SET_MS), refusal)


async def cut_and_heal_the_link(dashboard: Dashboard) -> None:
    """By its switch, and by the button beside the vehicle that has the fault."""
    link = dashboard.page.locator(".vehicle", has_text="v2").locator(".link-age")
    off, on = (dashboard.page.get_by_role("switch", name="Link cut", checked=checked) for checked in (False, True))
    await until_shown(partial(click_if_there, off), on)
    await expect(link).to_contain_text("lost", timeout=LINK_MS)
    await until_shown(partial(click_if_there, dashboard.button("Clear Link cut of v2")), off)
    await expect(link).not_to_contain_text("lost", timeout=LINK_MS)


async def until_shown(act: Callable[[], Awaitable[None]], effect: Locator) -> None:
    """
    Do this, and again until its effect shows. The simulator of a busy machine may be silent for longer than the
    service waits: then the act is refused, and the panel is empty for a moment, which forgets what was typed.
    """
    for _ in range(ATTEMPTS):
        with suppress(PageTimeout, AssertionError):
            await act()
            await expect(effect).to_be_visible(timeout=SET_MS)
            return
    raise AssertionError(f"it never showed: {effect}")


async def set_value(row: Locator, name: str, value: str) -> None:
    """Type it and set it."""
    await row.get_by_role("textbox", name=name).fill(value, timeout=SET_MS)
    await row.get_by_role("button", name=f"Set {name}").click(timeout=SET_MS)


async def click_if_there(button: Locator) -> None:
    """A press whose answer was lost may have counted: pressed again, a switch would undo it."""
    if await button.is_visible():
        await button.click(timeout=SET_MS)


async def test_a_simulator_that_answers_late_is_found_by_an_open_page(browser: Browser, tmp_path: Path) -> None:
    fleet = SimulatedFleet("quad")
    with simulated_service(tmp_path, fleet) as service:
        async with Dashboard.opened(browser, service.url, vehicles=0) as dashboard:
            found = await dashboard.page.request.get(f"{service.url}/api/v1/simulator")
            assert not (await found.json())["available"]
            tab = dashboard.page.get_by_role("tab", name="Simulator")
            await expect(tab).to_have_count(0)
            with fleet:
                await expect(tab).to_be_visible()


async def test_whoever_may_only_look_sees_the_faults_and_is_told_who_sets_them(idle_page: Dashboard) -> None:
    viewer = PrincipalView(name="desk", role=Role.VIEWER, roles=[Role.VIEWER])

    async def answer_as_viewer(route: Route) -> None:
        await route.fulfill(body=viewer.model_dump_json(), content_type="application/json")

    await idle_page.page.route("**/api/v1/principal", answer_as_viewer)
    await idle_page.page.reload()
    await idle_page.until_live()
    await idle_page.page.get_by_role("tab", name="Simulator").click()
    await expect(idle_page.page.get_by_role("note")).to_contain_text("(viewer)")
    await expect(idle_page.page.get_by_role("switch", name="Link cut")).to_be_disabled()
