"""The page on a service whose vehicles are on the ground: it loads clean, shows the fleet, and works everywhere."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Final

import pytest
from playwright.async_api import Browser, Route, ViewportSize, WebSocketRoute, expect

from tests.support.accessibility import DESKTOP, PHONE, WALL_DISPLAY, violations
from tests.support.dashboard import CLINIC_RUN, PATIENCE_MS, Dashboard
from tests.support.forked_service import ForkedService
from tests.support.paths import ROOT
from tests.support.picture import colours
from tests.support.service_process import ServiceProcess, until
from tests.support.simulated import free_udp_ports


async def test_the_fleet_appears_with_types_modes_battery_and_link(idle_page: Dashboard) -> None:
    rows = idle_page.page.locator(".vehicle")
    for row, words in zip(await rows.all(), ("Multicopter", "Multicopter", "Fixed wing", "VTOL"), strict=True):
        await expect(row).to_contain_text(words)
        await expect(row).to_contain_text("On ground")
        await expect(row.locator(".battery")).to_contain_text("%")
        await expect(row.locator(".link-age")).to_have_class("link-age ok")


async def test_the_map_is_drawn_without_any_tile_server(idle_page: Dashboard) -> None:
    await expect(idle_page.page.locator(".grid-labels span").first).to_be_visible()
    canvas = idle_page.page.locator(".map-canvas canvas")
    await until(lambda: colours(canvas), lambda count: count > 20, "grid, rings and vehicles must be drawn", 20)


async def test_a_telephone_shows_the_whole_header_while_the_page_connects(idle_page: Dashboard) -> None:
    await idle_page.page.set_viewport_size(PHONE)
    await idle_page.page.route_web_socket("**/api/v1/**", lambda _: None)  # opens, and never says hello
    await idle_page.page.reload()
    await expect(idle_page.page.locator(".connection")).to_contain_text("Connecting")
    last = await idle_page.page.get_by_role("button", name="theme").bounding_box()
    assert last is not None
    assert last["x"] + last["width"] <= PHONE["width"]


async def test_a_lost_connection_is_read_aloud_once_and_not_with_each_second(idle_page: Dashboard) -> None:
    async def refuse(socket: WebSocketRoute) -> None:
        await socket.close(code=1011, reason="restarting")

    await idle_page.page.route_web_socket("**/api/v1/stream*", refuse)
    await idle_page.page.reload()
    state = idle_page.page.locator(".connection")
    await expect(state).to_contain_text("retry in")
    # the first retries come within half a second: between two readings it may connect again
    heard = await until(state.aria_snapshot, lambda words: "No connection" in words, "a loss must be heard", 20)
    assert not re.search(r"\d", heard)


async def test_while_events_are_not_stored_the_header_says_what_may_not_be_current(idle_page: Dashboard) -> None:
    def full_disk(socket: WebSocketRoute) -> None:
        service = socket.connect_to_server()
        service.on_message(lambda frame: socket.send(str(frame).replace('"recording":true', '"recording":false')))

    await idle_page.page.route_web_socket("**/api/v1/stream*", full_disk)
    await idle_page.page.reload()
    await expect(idle_page.page.locator(".connection")).to_contain_text("Runs, drops and jobs may not be current")
    assert await violations(idle_page.page, "events that are not stored") == []


async def test_a_finding_stands_on_its_item_with_its_hint(idle_page: Dashboard) -> None:
    plan = json.loads(CLINIC_RUN)
    plan["items"].insert(1, {"id": "early", "type": "gripper", "action": "release", "release_motion": "stopped"})
    await idle_page.write_plan(json.dumps(plan))
    item = idle_page.page.locator(".plan-item", has_text="early")
    finding = item.locator(".finding", has_text="gripper.must_follow_waypoint")
    await expect(finding.locator(".hint")).to_be_visible()
    await expect(idle_page.button("Upload to v1")).to_be_disabled()


async def test_a_document_that_is_no_plan_is_told_so_and_cannot_be_uploaded(idle_page: Dashboard) -> None:
    await idle_page.write_plan('{"version": 1')
    await expect(idle_page.page.locator(".form-problem")).to_contain_text("This is not JSON")
    await idle_page.write_plan('{"version": 7}')
    await expect(idle_page.page.locator(".finding").first).to_be_visible()
    await expect(idle_page.page.get_by_role("button", name="Upload")).to_be_disabled()


async def test_a_plan_file_can_be_picked(idle_page: Dashboard) -> None:
    await idle_page.page.get_by_role("tab", name="Plan").click()
    async with idle_page.page.expect_file_chooser() as chooser:
        await idle_page.button("Open file").click()
    await (await chooser.value).set_files(ROOT / "plans" / "clinic-run.json")
    await expect(idle_page.page.get_by_role("heading", name="Clinic run")).to_be_visible()
    await expect(idle_page.page.get_by_text("Can be flown")).to_be_visible(timeout=20_000)


async def test_a_draft_the_units_and_what_is_selected_survive_a_reload(idle_page: Dashboard) -> None:
    await idle_page.write_plan(CLINIC_RUN)
    await idle_page.vehicle("v2").click()
    details = idle_page.page.locator(".vehicle-details")
    await expect(details).to_contain_text("0.0 m/s")
    await idle_page.page.get_by_label("Units").select_option("ft, kn")
    await idle_page.page.reload()
    await idle_page.until_live()
    await expect(idle_page.page.get_by_role("heading", name="Clinic run")).to_be_visible()
    await expect(idle_page.vehicle("v2")).to_have_attribute("aria-pressed", "true")
    await expect(details).to_contain_text("0.0 kn")
    await expect(idle_page.page.locator(".plan-items")).to_contain_text("66 ft above home")
    await idle_page.page.locator(".plan-item-main").nth(1).click()
    height = idle_page.page.locator(".field", has_text="Relative altitude")
    await expect(height).to_contain_text("(m) = 66 ft")  # a plan's fields stay in its own units, and say so
    await expect(height.get_by_role("textbox")).to_have_value("20")


async def test_a_refusal_of_the_service_is_told_in_words(idle_page: Dashboard) -> None:
    idle_page.tolerated = ("status of 404",)  # Chromium writes each refused request into its console
    await idle_page.write_plan(CLINIC_RUN)
    await expect(idle_page.page.get_by_text("Can be flown")).to_be_visible(timeout=20_000)

    async def ask_for_an_unknown_vehicle(route: Route) -> None:
        await route.continue_(post_data=json.dumps({"plan": "no-such-plan", "vehicle": "v1", "start": False}))

    await idle_page.page.route("**/api/v1/runs", ask_for_an_unknown_vehicle)
    await idle_page.button("Upload to v1").click()
    notice = idle_page.page.locator(".notice")
    await expect(notice).to_contain_text("Upload to v1")
    await expect(notice.locator("code")).to_have_text("resource.not_found")
    await notice.get_by_role("button", name="Dismiss").click()
    await expect(notice).to_have_count(0)


async def test_the_theme_follows_the_system_until_somebody_chooses(idle_page: Dashboard) -> None:
    html = idle_page.page.locator("html")
    await expect(html).to_have_attribute("data-theme", "dark")
    await idle_page.page.emulate_media(color_scheme="light")
    await expect(html).to_have_attribute("data-theme", "light")
    await idle_page.button("Switch to the dark theme").click()
    await idle_page.page.reload()
    await expect(html).to_have_attribute("data-theme", "dark")


async def test_no_view_has_an_accessibility_violation_in_any_theme_from_360_px_to_4k(
    browser: Browser, idle_service: ServiceProcess
) -> None:
    found: list[str] = []
    async with Dashboard.opened(browser, idle_service.url) as board:
        board.page.set_default_timeout(PATIENCE_MS)
        for size in (DESKTOP, PHONE, WALL_DISPLAY):
            await board.page.set_viewport_size(size)
            found += await violations_of_all_views(board, size)
    assert found == []


async def violations_of_all_views(board: Dashboard, size: ViewportSize) -> list[str]:
    """Each view, and the plan with findings from all its sides."""
    page, found = board.page, list[str]()

    async def look(where: str) -> None:
        found.extend(await violations(page, where, [size]))

    async def show(name: str) -> None:
        bar = page.get_by_role("navigation", name="Views", include_hidden=True)
        await bar.get_by_role("button", name=name, include_hidden=True).dispatch_event("click")

    for name in ("Map", "Run", "Jobs", "Manual control", "Fleet", "Events", "Faults"):
        await show(name)
        if name == "Fleet":
            await board.vehicle("v1").click()
        if name == "Faults":
            await expect(page.locator(".fault").first).to_be_visible(timeout=PATIENCE_MS)
        await look(name)
    await show("Manual control")
    await look("a vehicle for manual control")
    await show("Plan")
    await board.fill_plan(CLINIC_RUN.replace('"max_offset_m"', '"offset_m"'))
    await expect(page.locator(".plan-item")).to_have_count(5, timeout=PATIENCE_MS)
    await expect(page.locator(".finding").first).to_be_visible(timeout=PATIENCE_MS)
    await page.locator(".plan-item-main[aria-pressed='false']").first.click()
    await board.button("Draw a fence").click()
    for name in ("Items", "Area", "Details", "JSON"):
        await page.get_by_role("tab", name=name).click()
        await look(f"a plan's {name}")
    await page.locator(".check-result").evaluate("result => result.setAttribute('aria-busy', 'true')")
    await look("a plan that is being checked")
    await page.get_by_label("Plan as JSON").fill("")
    await look("no plan")
    return found


CUT_OFF: Final = """() => [...document.querySelectorAll('.top *, .panel > .tabs, .panel > .tabs *, .view-bar *')]
  .filter(part => part.checkVisibility() && !part.closest('.visually-hidden'))
  .filter(part => {
    const box = part.getBoundingClientRect(), around = part.closest('.top, .panel, .view-bar').getBoundingClientRect();
    const isOutside = box.left < around.left - 0.5 || box.right > around.right + 0.5;
    return isOutside || part.scrollWidth > part.clientWidth + 1 && part.clientWidth > 0;
  })
  .map(part => part.outerHTML.slice(0, 120))"""


async def test_no_tab_and_nothing_of_the_header_is_cut_off_from_360_px_to_4k(idle_page: Dashboard) -> None:
    page, cut = idle_page.page, dict[int, list[str]]()
    await expect(page.get_by_role("tab", name="Simulator")).to_be_visible()
    for width in (360, 768, 1024, 1280, 1440, 1920, 3840):
        await page.set_viewport_size({"width": width, "height": 800})
        if found := await page.evaluate(CUT_OFF):
            cut[width] = found
    assert cut == {}


@pytest.mark.parametrize("width", [360, 900, 1440, 3840])
async def test_every_view_fits_every_width(browser: Browser, idle_service: ServiceProcess, width: int) -> None:
    async with Dashboard.opened(browser, idle_service.url, width=width, height=800) as dashboard:
        bar = dashboard.page.get_by_role("navigation", name="Views").get_by_role("button")
        for button in await bar.all() if width < 1100 else [None]:
            if button is not None:
                await button.click()
                if await button.inner_text() == "Plan":
                    await dashboard.fill_plan(CLINIC_RUN)
                    await dashboard.page.locator(".plan-item-main").nth(1).click()
            size = await dashboard.page.evaluate(
                "() => [document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
            )
            assert size[0] <= width
            assert size[1] <= 800


async def test_the_documentation_page_needs_no_other_host(browser: Browser, idle_service: ServiceProcess) -> None:
    dashboard = Dashboard(await browser.new_page(), idle_service.url)
    await dashboard.page.goto(f"{idle_service.url}/api/v1/docs")
    await expect(dashboard.page.get_by_text("/api/v1/vehicles", exact=True).first).to_be_visible(timeout=20_000)
    await dashboard.page.close()
    assert dashboard.problems == []


async def test_a_service_with_tokens_asks_for_one_and_then_lets_in(browser: Browser, tmp_path: Path) -> None:
    token = "a-token-of-this-test-alone"
    connection = f"udpin://127.0.0.1:{free_udp_ports(1)}"
    with ForkedService(tmp_path, [connection], WAYDROP_BOOTSTRAP_TOKEN=token) as service:
        dashboard = Dashboard(await browser.new_page(), service.url)
        await dashboard.page.goto(service.url)
        await expect(dashboard.page.get_by_role("dialog")).to_be_visible(timeout=20_000)
        assert await violations(dashboard.page, "the question for a token") == []
        for _ in range(3):  # Chromium lets nobody keep a dialog open
            await dashboard.page.keyboard.press("Escape")
        await expect(dashboard.page.get_by_role("dialog")).to_have_count(0)
        await dashboard.button("Enter token").click()
        await dashboard.page.get_by_label("Access token").fill("another-token")
        await dashboard.button("Connect").click()
        await expect(dashboard.page.get_by_text("The token was rejected")).to_be_visible()
        await dashboard.page.get_by_label("Access token").fill(token)
        await dashboard.button("Connect").click()
        await dashboard.until_live()
        await expect(dashboard.page.get_by_role("dialog")).to_have_count(0)
        await dashboard.page.close()


async def test_a_question_mark_lists_the_shortcuts_unless_it_is_typed(idle_page: Dashboard) -> None:
    dialog = idle_page.page.get_by_role("dialog", name="Keyboard shortcuts")
    search = idle_page.page.get_by_label("Search the fleet")
    await search.press("?")
    await expect(search).to_have_value("?")
    await expect(dialog).to_have_count(0)
    await search.fill("")
    await idle_page.page.get_by_role("tab", name="Plan").press("?")
    await expect(dialog).to_contain_text("Undo")
    assert await violations(idle_page.page, "the shortcuts") == []
    await idle_page.page.keyboard.press("Escape")
    await expect(dialog).to_have_count(0)
    await idle_page.button("Keyboard shortcuts").click()
    await dialog.get_by_role("button", name="Close").click()
    await expect(dialog).to_have_count(0)


async def test_an_empty_page_says_the_first_step(browser: Browser, tmp_path: Path) -> None:
    with ForkedService(tmp_path, [f"udpin://127.0.0.1:{free_udp_ports(1)}"]) as service:
        async with Dashboard.opened(browser, service.url, vehicles=0) as board:
            await expect(board.page.get_by_role("region", name="Fleet")).to_contain_text("waydrop up")
            await board.page.get_by_role("tab", name="Jobs").click()
            await board.button("Open a plan to queue it").click()
            await expect(board.page.get_by_role("tab", name="Plan")).to_have_attribute("aria-selected", "true")
