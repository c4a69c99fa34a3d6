"""Faults from the page: a cut link is seen and healed, a refusal is told, a viewer may only look."""

from __future__ import annotations

from pathlib import Path

from playwright.async_api import Browser, Locator, Route, expect

from app.api.principal import PrincipalView
from app.services.access import Role
from tests.browser.conftest import simulated_service
from tests.support.dashboard import Dashboard
from tests.support.simulated import SimulatedFleet

LINK_MS = 30_000


def fault(dashboard: Dashboard, name: str) -> Locator:
    """The row of a fault."""
    return dashboard.page.locator(f'.fault[data-fault="{name}"]')


async def test_faults_are_set_seen_on_the_fleet_cleared_and_refused(browser: Browser, tmp_path: Path) -> None:
    with SimulatedFleet("quad,quad") as fleet, simulated_service(tmp_path, fleet) as service:
        async with Dashboard.opened(browser, service.url, vehicles=2) as dashboard:
            dashboard.tolerated = ("status of 4",)  # Chromium writes each refused request into its console
            await dashboard.page.get_by_role("tab", name="Simulator").click()
            await dashboard.page.locator(".sim-vehicle", has_text="v2").get_by_role("button").first.click()
            link = dashboard.page.locator(".vehicle", has_text="v2").locator(".link-age")
            cut = dashboard.page.get_by_role("switch", name="Link cut")

            await cut.click()
            await expect(cut).to_be_checked()
            await expect(link).to_contain_text("lost", timeout=LINK_MS)
            await dashboard.button("Clear Link cut of v2").click()
            await expect(cut).not_to_be_checked()
            await expect(link).not_to_contain_text("lost", timeout=LINK_MS)

            loss = fault(dashboard, "loss")
            await loss.get_by_role("textbox", name="Loss").fill("7")
            await loss.get_by_role("button", name="Set Loss").click()
            await expect(loss.get_by_role("alert")).to_contain_text("must be at most 1, not 7")
            await loss.get_by_role("textbox", name="Loss").fill("0.05")
            await loss.get_by_role("button", name="Set Loss").click()
            await expect(loss).to_contain_text("Now 0.05")

            await dashboard.page.get_by_role("button", name="10 times real time").click()
            await expect(dashboard.page.locator(".sim-speed-now")).to_contain_text("refused above 4")

            winch = fault(dashboard, "stuck_winch")
            await winch.get_by_role("switch").click()
            await expect(winch.get_by_role("alert")).to_contain_text("winch")


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
