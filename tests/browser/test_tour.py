"""The tour of a first flight: offered where vehicles are simulated, it goes on with what the user does."""

from __future__ import annotations

from playwright.async_api import Browser, expect

from tests.support.accessibility import violations
from tests.support.dashboard import Dashboard
from tests.support.service_process import ServiceProcess

OFFER = "Take a tour"


async def test_a_newcomer_is_led_to_a_plan_that_can_be_uploaded(idle_page: Dashboard) -> None:
    tour = idle_page.page.get_by_role("complementary", name="Tour")
    await idle_page.button(OFFER).click()
    await expect(tour).to_contain_text("Step 1 of 5")
    await tour.get_by_role("button", name="Select v1").click()
    await expect(tour).to_contain_text("Step 2 of 5")
    await tour.get_by_role("button", name="Open example plan").click()
    await expect(tour).to_contain_text("Step 3 of 5")
    await expect(idle_page.page.get_by_text("Can be flown", exact=True)).to_be_visible()
    await expect(idle_page.button("Upload to v1")).to_be_enabled()
    assert await violations(idle_page.page, "the tour") == []
    await tour.get_by_role("button", name="End tour").click()
    await expect(tour).to_have_count(0)


async def test_on_a_narrow_page_the_help_offers_the_tour_and_it_covers_nothing(
    browser: Browser, idle_service: ServiceProcess
) -> None:
    async with Dashboard.opened(browser, idle_service.url, width=360, height=800, scheme="light") as board:
        tour = board.page.get_by_role("complementary", name="Tour")
        await board.button("Keyboard shortcuts").click()
        await board.page.get_by_role("dialog").get_by_role("button", name=OFFER).click()
        await expect(board.page.get_by_role("dialog")).to_be_hidden()
        await tour.get_by_role("button", name="Select v1").click()
        await tour.get_by_role("button", name="Open example plan").click()
        await expect(tour).to_contain_text("Step 3 of 5")
        assert await violations(board.page, "the tour at 360 px") == []
        width = await board.page.evaluate("document.documentElement.scrollWidth")
        assert width == 360
        below, main = await tour.bounding_box(), await board.page.locator("main").bounding_box()
        assert below is not None
        assert main is not None
        assert below["y"] + below["height"] <= main["y"]
