"""Flying by hand from the page: nothing moves a vehicle without a lease and hands, and it holds when they go away."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from typing import Any, Final

import aiohttp
import pytest
from playwright.async_api import Browser, Locator, expect

from tests.browser.conftest import FLEET, SPEED, simulated_service
from tests.browser.dashboard import HOLD_MS, Dashboard
from tests.browser.test_page import AXE
from tests.e2e.by_hand import paused_in_the_air, truth
from tests.service import Dispatcher, ServiceProcess, until
from tests.simulated import SimulatedFleet

RETURN = "COM_OBL_RC_ACT=3"
"""The vehicle's own answer to a lost stream is another mode than the Hold that Waydrop commands."""
GAP_S = 2.5
"""More than the default: on a busy machine a healthy process may stand still for longer than that."""
ATTEMPTS = 6

SMALL: Final[dict[str, Any]] = {"width": 360, "height": 800}
"""Software draws a small map fast: the page must not stand still, or the dead-man rightly acts."""
AXE_ON_PANEL = """async () => {
  const part = { rules: { 'heading-order': { enabled: false } } };  // the headings before it are not looked at
  return (await axe.run('.hands-on', part)).violations.map(v => [v.id, v.nodes.map(n => n.html)]);
}"""

PAD = """axes => { navigator.getGamepads = () => [{ id: 'Test pad', connected: true, axes, buttons: [] }]; }"""
"""A gamepad with its sticks so."""
MOVED_M = 3.0


class Cockpit:
    """The hands-on panel of v1."""

    def __init__(self, dashboard: Dashboard) -> None:
        self.dashboard = dashboard
        self.page = dashboard.page
        self.panel = dashboard.page.locator(".hands-on")
        self.sent = self.panel.locator(".sent-words dd")
        self.views = dashboard.page.get_by_role("navigation", name="Views")

    async def open(self, vehicle_id: str = "v1") -> None:
        """Choose the vehicle and its panel, on a narrow page."""
        await self.views.get_by_role("button", name="Fleet").click()
        await self.dashboard.vehicle(vehicle_id).click()
        await self.views.get_by_role("button", name="Hands on").click()

    def phase(self, name: str) -> Locator:
        """The panel, while it is in this phase."""
        return self.page.locator(f'.hands-on[data-phase="{name}"]')

    async def take(self) -> None:
        """The lease, and nothing more."""
        await self.dashboard.button("Take the lease of v1").click()
        await expect(self.phase("leased")).to_be_visible()

    async def enter(self) -> None:
        """Hands on. A page that stood still for a second on a busy machine has lost its lease: then again."""
        for _ in range(ATTEMPTS):
            await self.take()
            await expect(self.dashboard.button("Take control of v1")).to_be_enabled()
            await self.dashboard.hold("Take control of v1")
            await expect(self.page.locator('.hands-on:is([data-phase="flying"], [data-phase="off"])')).to_be_visible(
                timeout=30_000
            )
            if await self.is_flying():
                return
        raise AssertionError(await self.panel.inner_text())

    async def is_flying(self) -> bool:
        """Whether the hands are still on."""
        return await self.panel.get_attribute("data-phase") == "flying"

    async def says(self, words: str) -> bool:
        """Wait until this is really sent; False if the lease was lost on the way."""
        seen = self.sent.filter(has_text=words)
        await expect(seen.or_(self.phase("off"))).to_be_visible(timeout=30_000)
        return await self.is_flying()


@pytest.fixture(scope="module")
def fleet_and_service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[SimulatedFleet, ServiceProcess]]:
    """One flight for all tests here: the climb takes longer than they do."""
    folder = tmp_path_factory.mktemp("by-hand")
    with (
        SimulatedFleet(FLEET, speed=SPEED, params=RETURN) as fleet,
        simulated_service(folder, fleet, WAYDROP_OFFBOARD_GAP_S=str(GAP_S)) as service,
    ):
        yield fleet, service


@pytest.fixture
async def fleet_and_cockpit(
    browser: Browser, fleet_and_service: tuple[SimulatedFleet, ServiceProcess]
) -> AsyncIterator[tuple[SimulatedFleet, Cockpit, Dispatcher]]:
    """v1 in the air on a paused run, and the page beside it."""
    fleet, service = fleet_and_service
    async with aiohttp.ClientSession() as http:
        dispatcher = Dispatcher(http, service.url)
        run_id = (await dispatcher.until_vehicles(4))["v1"]["run_id"]
        if run_id is None or (await dispatcher.get(f"/runs/{run_id}"))["state"] != "paused":
            await paused_in_the_air(dispatcher)
        async with Dashboard.opened(browser, service.url, **SMALL) as dashboard:
            cockpit = Cockpit(dashboard)
            await cockpit.open()
            yield fleet, cockpit, dispatcher


def has_moved_from(before: dict[str, Any], now: dict[str, Any]) -> bool:
    """By a few metres over ground."""
    north = (now["latitude_deg"] - before["latitude_deg"]) * 111_195.0
    east = (now["longitude_deg"] - before["longitude_deg"]) * 75_000.0
    return bool(north * north + east * east > MOVED_M * MOVED_M)


async def flown_by_keys(fleet: SimulatedFleet, cockpit: Cockpit) -> bool:
    """Forward until the simulated vehicle has really moved, then the window loses the focus under a held key."""
    await cockpit.enter()
    began = await truth(fleet)
    await cockpit.page.keyboard.down("w")

    async def moved() -> tuple[bool, bool]:
        return has_moved_from(began, await truth(fleet)), await cockpit.is_flying()

    await until(moved, lambda seen: seen[0] or not seen[1], "it must fly as the key says", 60)
    lit = await cockpit.panel.locator(".keys .held").count()
    if not await cockpit.is_flying():
        return False
    assert lit == 1, "the key that is held is lit"
    await cockpit.page.evaluate("window.dispatchEvent(new Event('blur'))")
    return "lost the focus" in await cockpit.panel.inner_text()


async def test_the_keyboard_flies_it_and_a_blur_is_hold_until_a_new_lease_is_taken(
    fleet_and_cockpit: tuple[SimulatedFleet, Cockpit, Dispatcher],
) -> None:
    fleet, cockpit, dispatcher = fleet_and_cockpit
    for _ in range(ATTEMPTS):
        if await flown_by_keys(fleet, cockpit):
            break
        await cockpit.page.keyboard.up("w")
        await expect(cockpit.phase("off")).to_be_visible()
    await expect(cockpit.phase("off")).to_be_visible()
    await expect(cockpit.panel).to_contain_text("The window lost the focus. The client was silent")
    await expect(cockpit.panel.locator(".dead-man .current")).to_contain_text("Hold")
    await until(lambda: truth(fleet), lambda v: v["mode"] == "LOITER", "it must hold, not do what it does alone", 30)
    await cockpit.panel.focus()
    await cockpit.page.keyboard.down("w")  # still held, and pressed again: nobody has the lease
    view = await dispatcher.get("/vehicles/v1/offboard")
    assert (view["offboard"]["state"], view["offboard"]["lease"]) == ("idle", None)
    assert (await truth(fleet))["mode"] == "LOITER"
    await cockpit.page.keyboard.up("w")

    await cockpit.enter()
    await cockpit.views.get_by_role("button", name="Run").focus()
    await expect(cockpit.phase("off")).to_be_visible()
    await expect(cockpit.panel).to_contain_text("The focus left the controls.")


async def every_control(cockpit: Cockpit) -> bool:
    """Sticks, a gamepad, a place on the map, each as it is really sent; False if the lease was lost on the way."""
    page, panel = cockpit.page, cockpit.panel
    await cockpit.enter()
    box = await panel.locator('[data-stick="Move"]').bounding_box()
    assert box is not None
    await page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    await page.mouse.down()
    await page.mouse.move(box["x"] + box["width"], box["y"] + box["height"] / 2)
    if not await cockpit.says("right"):
        return False
    await page.mouse.up()
    if not await cockpit.says("stand still"):
        return False
    await page.evaluate(PAD, [0, -1, 0, 0])
    await expect(panel.locator('.gamepad[data-state="waits"]').or_(cockpit.phase("off"))).to_be_visible()
    await page.evaluate(PAD, [0, 0, 0, 0])
    await expect(panel.locator('.gamepad[data-state="counts"]').or_(cockpit.phase("off"))).to_be_visible()
    await page.evaluate(PAD, [0, -1, 0, 0])
    if not await cockpit.says("up"):
        return False
    await page.evaluate(PAD, [0, 0, 0, 0])
    go = panel.get_by_role("button", name="Go to a place")
    if not await cockpit.says("stand still") or not await go.is_visible():
        return False
    await go.click()
    map_box = await page.locator(".map-canvas").bounding_box()
    assert map_box is not None
    await page.mouse.click(map_box["x"] + map_box["width"] / 2 + 20, map_box["y"] + map_box["height"] / 2 - 20)
    return await cockpit.says("go to a place")


async def test_sticks_a_gamepad_and_a_place_on_the_map_fly_it_and_the_mission_goes_on(
    fleet_and_cockpit: tuple[SimulatedFleet, Cockpit, Dispatcher],
) -> None:
    _, cockpit, dispatcher = fleet_and_cockpit
    for _ in range(ATTEMPTS):
        if await every_control(cockpit):
            break
        await cockpit.page.mouse.up()
        await expect(cockpit.phase("off")).to_be_visible()
    await cockpit.page.evaluate(AXE())
    if not await cockpit.is_flying():
        await cockpit.enter()
    assert await cockpit.page.evaluate(AXE_ON_PANEL) == []  # it takes so long that the dead-man may act meanwhile
    for _ in range(ATTEMPTS):
        if not await cockpit.is_flying():
            await cockpit.enter()
        back = cockpit.dashboard.button("Back to the mission: v1").and_(cockpit.page.locator(":enabled"))
        await expect(back.or_(cockpit.phase("off"))).to_be_visible()
        if await back.is_visible():
            await back.click(delay=HOLD_MS)
        await expect(cockpit.phase("off")).to_be_visible()
        if "Left to the mission" in await cockpit.panel.inner_text():
            break
    await expect(cockpit.panel).to_contain_text("Left to the mission")
    run_id = (await dispatcher.get("/vehicles/v1"))["run_id"]
    await dispatcher.until_run(run_id, lambda run: run["state"] in ("flying", "at_drop"), "it must go on", 20)


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
    await expect(other.panel.locator(".hands-holder")).to_contain_text("local has the lease of v1")
    await second.button("Take the lease of v1").click()
    refusal = other.panel.get_by_role("alert")
    await expect(refusal).to_contain_text("Wait until it ends, ask for a hand-over")
    await expect(refusal.locator("code")).to_have_text("offboard.lease_held")

    await page.reload()  # the lease ends with the page, and is not taken again by it
    await cockpit.dashboard.until_live()
    await expect(cockpit.phase("off")).to_be_visible()
    await expect(other.panel.locator(".hands-holder")).to_contain_text("Nobody has the lease of v1")
    assert not any('"setpoint"' in frame for frame in sent), "keys without hands on mean nothing"


async def test_what_the_page_cannot_fly_is_said_with_the_reason(idle_page: Dashboard) -> None:
    await idle_page.vehicle("v3").click()
    await idle_page.page.get_by_role("tab", name="Hands on").click()
    note = idle_page.page.locator(".hands-note")
    await expect(note).to_contain_text("No sticks or keys for v3: PX4 does not follow it")
    await expect(idle_page.button("Take the lease of v3")).to_be_disabled()
