"""`python -m tests.browser.screenshots FOLDER [IMAGES]`: pictures of the page on the real service, in all its looks.

Not a test: for the eyes of whoever changed the page. The two that the README shows are written to IMAGES.
"""

from __future__ import annotations

import asyncio
import json
import shutil
import sys
import tempfile
from pathlib import Path

from playwright.async_api import Browser, async_playwright, expect

from tests.browser.conftest import CHROMIUM, FLEET, GAP_S, SPEED, chromium_args, simulated_service
from tests.support.dashboard import CLINIC_RUN, FLIGHT_MS, PATIENCE_MS, Dashboard, Scheme
from tests.support.offboard_panel import PRESS_MS, OffboardPanel
from tests.support.paths import ROOT
from tests.support.simulated import SimulatedFleet

SCHEMES: tuple[Scheme, ...] = ("dark", "light")
SIZES = {"wide": (1440, 900), "middle": (900, 700), "narrow": (360, 800), "wall": (3840, 2160)}
SETTLED_MS = 3_000
"""Until the map has been moved and drawn; a picture is not worth more care."""
VIEWS = ("Map", "Fleet", "Plan", "Run", "Jobs", "Manual control", "Faults", "Events")


def faulty_plan() -> str:
    """A plan with findings on several items."""
    plan = json.loads(CLINIC_RUN)
    plan["items"].insert(1, {"id": "early", "type": "gripper", "action": "release", "release_motion": "stopped"})
    plan["items"][2]["latitude_deg"] += 0.002
    return json.dumps(plan, indent=2)


def file_name(view: str) -> str:
    """A view's name as part of a file's."""
    return view.lower().replace(" ", "-")


async def wide(browser: Browser, url: str, folder: Path) -> None:
    """The whole way of a delivery, as in the documentation."""
    async with Dashboard.opened(browser, url, fine_map=True) as board:
        await board.page.screenshot(path=folder / "start.png")
        await board.button("Not now").click()  # no street map
        await board.write_plan(faulty_plan())
        await expect(board.page.locator(".finding").first).to_be_visible()
        await board.page.screenshot(path=folder / "findings.png")
        await board.upload(CLINIC_RUN, "v1")
        await board.page.screenshot(path=folder / "uploaded.png")
        await board.hold("Start v1")
        await board.until_state("at_drop")
        await board.page.screenshot(path=folder / "at-drop.png")
        await expect(board.page.locator(".drop-card .badge")).to_have_text("Released", timeout=FLIGHT_MS)
        await board.until_state("completed")
        await board.page.screenshot(path=folder / "completed.png")
        async with board.page.expect_file_chooser() as choosing:
            await board.button("Attach a photo, signature or PDF to drop").click()
        await (await choosing.value).set_files(folder / "at-drop.png")
        await board.button("Show at-drop.png").click()
        await expect(board.page.get_by_role("dialog", name="at-drop.png").get_by_role("img")).to_be_visible()
        await board.page.screenshot(path=folder / "attachment.png")


async def order_jobs(browser: Browser, url: str) -> None:
    """One that a vehicle flies at once, and one that none of the fleet can."""
    page = await browser.new_page()
    for plan in ("multicopter-embedded.json", "rover-drop.json"):
        body = json.loads((ROOT / "plans" / plan).read_text())
        answer = await page.request.post(f"{url}/api/v1/jobs", data={"plan": body})
        assert answer.ok, await answer.text()
    await page.close()


async def editor(browser: Browser, url: str, folder: Path) -> None:
    """A fixed wing's plan whose drop is farther from its point than the plan allows."""
    plan = (ROOT / "plans" / "fixed-wing-pass.json").read_text()
    async with Dashboard.opened(browser, url, scheme="light", fine_map=True) as board:
        await board.button("Not now").click()  # no street map
        await board.write_plan(plan.replace('"max_offset_m": 50', '"max_offset_m": 10'))
        await expect(board.page.locator(".finding").first).to_be_visible()
        await expect(board.page.locator('.check-result[aria-busy="false"]')).to_be_visible()
        await board.page.locator(".plan-item .finding").scroll_into_view_if_needed()
        await board.page.wait_for_timeout(SETTLED_MS)
        await board.page.screenshot(path=folder / "editor.png")


async def tasks(board: Dashboard, path: Path) -> None:
    """With the lease: one task in the queue, and another one that is put together."""
    offboard = OffboardPanel(board)
    await offboard.unless_lost(lambda: queue_one_and_draw_another(offboard, path))


async def queue_one_and_draw_another(offboard: OffboardPanel, path: Path) -> None:
    panel, page = offboard.panel, offboard.page
    await offboard.take()
    for kind, places in (("Circle", ((60, 40),)), ("Path", ((-60, -30), (-20, 40), (20, -40)))):
        await panel.get_by_role("button", name=kind, exact=True).click(timeout=PRESS_MS)
        box = await offboard.box(".map-canvas")
        for right, down in places:
            await page.mouse.click(box["x"] + box["width"] / 2 + right, box["y"] + box["height"] / 2 + down)
        if kind == "Circle":
            await panel.get_by_role("button", name="Add to the queue").click(timeout=PRESS_MS)
            await expect(panel.locator(".task")).to_have_count(1)
    await panel.locator(".tasks").evaluate("tasks => tasks.scrollIntoView({block: 'start'})")
    await page.screenshot(path=path)
    await offboard.press("Release the lease")


async def every_view(browser: Browser, url: str, folder: Path, size: str, scheme: Scheme) -> None:
    """After the flight, each view that the size has."""
    width, height = SIZES[size]
    async with Dashboard.opened(browser, url, width=width, height=height, scheme=scheme, fine_map=True) as board:
        board.page.set_default_timeout(PATIENCE_MS)
        if width >= 1100:
            await board.write_plan(CLINIC_RUN)
            await expect(board.page.get_by_text("Can be flown")).to_be_visible(timeout=20_000)
            await board.page.screenshot(path=folder / f"{size}-{scheme}.png")
            await board.page.locator(".plan-item-main").nth(2).click()
            await board.page.screenshot(path=folder / f"{size}-{scheme}-editor.png")
            for tab in ("Area", "Details", "JSON", "Run", "Jobs", "Manual control", "Simulator"):
                await board.page.get_by_role("tab", name=tab).click()
                await board.page.wait_for_timeout(SETTLED_MS)
                await board.page.screenshot(path=folder / f"{size}-{scheme}-{file_name(tab)}.png")
                if tab == "Manual control":
                    await board.vehicle("v1").click()
                    await tasks(board, folder / f"{size}-{scheme}-tasks.png")
            return
        views = board.page.get_by_role("navigation", name="Views")
        for view in VIEWS:
            await views.get_by_role("button", name=view).click()
            if view == "Plan":
                await board.fill_plan(faulty_plan())
                await expect(board.page.locator(".finding").first).to_be_visible()
            await board.page.wait_for_timeout(SETTLED_MS)
            await board.page.screenshot(path=folder / f"{size}-{scheme}-{file_name(view)}.png")
            if view == "Plan":
                await board.page.locator(".plan-item-main").nth(2).click()
                await board.page.screenshot(path=folder / f"{size}-{scheme}-editor.png")
            if view == "Manual control":
                await views.get_by_role("button", name="Fleet").click()
                await board.vehicle("v1").click()
                await views.get_by_role("button", name=view).click()
                await tasks(board, folder / f"{size}-{scheme}-tasks.png")


async def main(folder: Path, images: Path | None) -> None:
    folder.mkdir(parents=True, exist_ok=True)  # noqa: ASYNC240 nothing else runs yet
    with (
        tempfile.TemporaryDirectory() as data,
        SimulatedFleet(FLEET, speed=SPEED) as fleet,
        simulated_service(Path(data), fleet, WAYDROP_OFFBOARD_GAP_S=str(GAP_S)) as service,
    ):
        async with async_playwright() as playwright:
            browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=chromium_args())
            await editor(browser, service.url, folder)
            await wide(browser, service.url, folder)
            await order_jobs(browser, service.url)
            if images is not None:
                shutil.copy(folder / "at-drop.png", images / "page.png")
                shutil.copy(folder / "editor.png", images / "editor.png")
            for scheme in SCHEMES:
                for size in SIZES:
                    await every_view(browser, service.url, folder, size, scheme)
            board = Dashboard(await browser.new_page(viewport={"width": 360, "height": 800}), service.url)
            await board.open()
            service.kill()
            await expect(board.page.locator(".connection.lost")).to_be_visible(timeout=20_000)
            await board.page.screenshot(path=folder / "narrow-lost.png")
            await browser.close()


if __name__ == "__main__":
    asyncio.run(main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None))
