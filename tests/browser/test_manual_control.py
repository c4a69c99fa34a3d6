"""Manual control on the page: nothing moves a vehicle without a lease, and it holds when the lease goes."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Iterator
from contextlib import suppress
from typing import Any

import aiohttp
import pytest
import pytest_asyncio
from playwright.async_api import Browser, expect

from tests.browser.conftest import GAP_S, SPEED, simulated_service
from tests.support.accessibility import AXE
from tests.support.dashboard import HOLD_MS, Dashboard, waiting_run
from tests.support.offboard_client import paused_in_the_air, truth
from tests.support.offboard_panel import PRESS_MS, SMALL, OffboardPanel
from tests.support.patience import Patience
from tests.support.service_process import Dispatcher, ServiceProcess, until
from tests.support.simulated import SimulatedFleet
from tests.support.task_queue_panel import CIRCLE, PATH, TaskBoard

RETURN = "COM_OBL_RC_ACT=3"
"""The vehicle's own answer to a lost stream is another mode than the Hold that Waydrop commands."""

AXE_ON_PANEL = """async () => {
  const part = { rules: { 'heading-order': { enabled: false } } };  // the headings before it are not looked at
  return (await axe.run('.offboard', part)).violations.map(v => [v.id, v.nodes.map(n => n.html)]);
}"""

PAD = """([mapping, ...axes]) => {
  navigator.getGamepads = () => [{ id: 'Test pad', connected: true, mapping, axes, buttons: [] }];
}"""
"""A gamepad with its sticks so, and whether the browser knows which axis is which ("standard")."""
MOVED_M = 3.0
PAUSED_S = 120.0
LOOK_S = 0.5
"""So that what was commanded is mostly seen at the next look."""


@pytest.fixture(scope="module")
def fleet_and_service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[SimulatedFleet, ServiceProcess]]:
    """One flight for all tests here: the climb takes longer than they do."""
    folder = tmp_path_factory.mktemp("manual-control")
    with (
        SimulatedFleet("quad", speed=SPEED, params=RETURN) as fleet,
        simulated_service(folder, fleet, WAYDROP_OFFBOARD_GAP_S=str(GAP_S)) as service,
    ):
        yield fleet, service


@pytest_asyncio.fixture(loop_scope="session")
async def fleet_and_panel(
    browser: Browser, fleet_and_service: tuple[SimulatedFleet, ServiceProcess]
) -> AsyncIterator[tuple[SimulatedFleet, OffboardPanel, Dispatcher]]:
    """v1 in the air on a paused run, and the page beside it."""
    fleet, service = fleet_and_service
    async with aiohttp.ClientSession() as http:
        dispatcher = Dispatcher(http, service.url)
        await dispatcher.until_vehicles(1)
        await until_paused(dispatcher)
        async with Dashboard.opened(browser, service.url, vehicles=1, **SMALL) as dashboard:
            offboard = OffboardPanel(dashboard, restore=lambda: until_paused(dispatcher))
            await offboard.open()
            yield fleet, offboard, dispatcher


async def until_paused(dispatcher: Dispatcher) -> None:
    """v1 in Hold in the air on a paused run: the one that it has, which another test may have sent on, or a new one."""
    patience = Patience(PAUSED_S)
    while (command := await missing_command(dispatcher)) != "":
        assert not patience.is_over(), f"it must pause; last: {command}, {await dispatcher.get('/vehicles/v1')}"
        if command == "a new run":
            await paused_in_the_air(dispatcher, json.loads(waiting_run()))
        elif command != "wait":
            with suppress(AssertionError):  # refused: it does something else by now, so it is looked at again
                await dispatcher.post(command)
        await asyncio.sleep(LOOK_S)


async def missing_command(dispatcher: Dispatcher) -> str:
    """What v1 has to be told so that it holds on a paused run; nothing if it does."""
    vehicle = await dispatcher.get("/vehicles/v1")
    state, run_id = vehicle["state"], vehicle["run_id"]
    if not state["armed"]:
        return "a new run" if run_id is None else "wait"  # until the one that it had has ended
    if run_id is None:
        return "/vehicles/v1/land"
    if (await dispatcher.get(f"/runs/{run_id}"))["state"] != "paused":
        return f"/runs/{run_id}/pause"
    return "" if state["mode"] == "hold" else "/vehicles/v1/hold"  # it acts alone, after it heard no setpoints


def has_moved_from(before: dict[str, Any], now: dict[str, Any]) -> bool:
    """By a few metres over ground."""
    north = (now["latitude_deg"] - before["latitude_deg"]) * 111_195.0
    east = (now["longitude_deg"] - before["longitude_deg"]) * 75_000.0
    return bool(north * north + east * east > MOVED_M * MOVED_M)


async def nothing(_: OffboardPanel) -> None:
    """Manual control is enough."""


async def armed_on_the_map(offboard: OffboardPanel) -> None:
    """The go-to tool is in hand, and the map has the focus."""
    await offboard.press("Go to a point")
    await offboard.page.locator(".map-canvas canvas").focus()


async def test_the_keyboard_flies_it_and_a_blur_is_hold_until_a_new_lease_is_taken(
    fleet_and_panel: tuple[SimulatedFleet, OffboardPanel, Dispatcher],
) -> None:
    fleet, offboard, dispatcher = fleet_and_panel
    page = offboard.page

    async def forward(offboard: OffboardPanel) -> None:
        """Until the simulated vehicle has really moved. The key stays down."""
        began = await truth(fleet)
        await offboard.panel.focus()
        await page.keyboard.down("w")

        async def moved() -> tuple[bool, bool]:
            return has_moved_from(began, await truth(fleet)), await offboard.is_flying()

        await until(moved, lambda seen: seen[0] or not seen[1], "it must fly as the key says", 60)
        assert await offboard.panel.locator(".keys .held").count() == 1, "the key that is held is lit"

    async def blur() -> None:
        await page.evaluate("window.dispatchEvent(new Event('blur'))")

    await offboard.fly_until_lost(forward, blur, "The window lost the focus. The client was silent")
    await expect(offboard.panel.locator(".dead-man .current")).to_contain_text("Hold")
    await until(lambda: truth(fleet), lambda v: v["mode"] == "LOITER", "it must hold, not do what it does alone", 30)
    await offboard.panel.focus()
    await page.keyboard.down("w")  # still held, and pressed again: nobody has the lease
    view = await dispatcher.get("/vehicles/v1/offboard")
    assert (view["offboard"]["state"], view["offboard"]["lease"]) == ("idle", None)
    assert (await truth(fleet))["mode"] == "LOITER"
    await page.keyboard.up("w")

    run_tab = offboard.views.get_by_role("button", name="Run")
    await offboard.fly_until_lost(nothing, run_tab.focus, "The focus left the controls.")
    await offboard.fly_until_lost(armed_on_the_map, lambda: page.keyboard.press("Escape"), "You exited to Hold.")


async def test_tasks_are_clicked_on_the_map_put_in_order_and_flown_until_the_pilot_takes_over(
    fleet_and_panel: tuple[SimulatedFleet, OffboardPanel, Dispatcher],
) -> None:
    _, offboard, dispatcher = fleet_and_panel
    board = TaskBoard(offboard, dispatcher)

    async def steps() -> None:
        await board.of_another_client({"type": "goto", "point": {"east_m": 0, "north_m": 20}})
        await offboard.take()
        await board.queue_by_clicks()
        await board.reorder()
        await offboard.take_control()
        await offboard.panel.get_by_role("button", name="Tasks (3)").click(timeout=PRESS_MS)
        await expect(board.state("flying").locator(".task-progress")).to_contain_text("course")
        assert await offboard.page.evaluate(AXE_ON_PANEL) == []
        await board.edit()
        await board.refused("limit.altitude")
        await offboard.panel.focus()
        await offboard.page.keyboard.press("w")  # beside the tasks it means nothing
        await board.press("Controls")
        await offboard.page.keyboard.press("w")
        await offboard.until_text("zero velocity")
        await offboard.panel.get_by_role("button", name="Tasks (3)").click(timeout=PRESS_MS)
        await expect(board.state("manual")).to_be_visible()
        await offboard.until_text("zero velocity")
        await board.press("Fly the tasks")
        await expect(board.state("flying")).to_be_visible()
        await board.press("Remove task 3")
        await board.lists(CIRCLE, PATH)
        await offboard.press("Clear tasks of v1", hold_ms=HOLD_MS)
        await expect(board.state("standing")).to_be_visible()
        assert await offboard.is_flying(), await offboard.panel.inner_text()
        await offboard.press("Exit to Hold")
        await expect(offboard.phase("off")).to_be_visible()

    await offboard.page.evaluate(AXE.read_text())
    await offboard.unless_lost(steps)


async def keys_only_with_the_focus(offboard: OffboardPanel) -> None:
    """A key that is down when the focus goes to the map asks for nothing any more."""
    await offboard.panel.focus()
    await offboard.page.keyboard.down("w")
    await offboard.until_text("forward")
    await offboard.page.locator(".map-canvas canvas").focus()
    await offboard.until_text("zero velocity")
    await offboard.page.keyboard.up("w")


async def stick_and_gamepad(offboard: OffboardPanel) -> None:
    """Each as it is really sent. A gamepad counts from its middle, and only if it is known which axis is which."""
    page = offboard.page
    box = await offboard.box('[data-stick="Move"]')
    await page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    await page.mouse.down()
    await page.mouse.move(box["x"] + box["width"], box["y"] + box["height"] / 2)
    await offboard.until_text("right")
    await page.mouse.up()
    await offboard.until_text("zero velocity")
    for mapping, climb, state in (("", 0, "unmapped"), ("standard", -1, "uncentred"), ("standard", 0, "active")):
        await page.evaluate(PAD, [mapping, 0, climb, 0, 0])
        seen = offboard.panel.locator(f'.gamepad[data-state="{state}"]')
        await expect(seen.or_(offboard.phase("off"))).to_be_visible()
    await page.evaluate(PAD, ["standard", 0, -1, 0, 0])
    await offboard.until_text("up")
    await page.evaluate(PAD, ["standard", 0, 0, 0, 0])
    await offboard.until_text("zero velocity")


async def place_on_the_map(offboard: OffboardPanel) -> None:
    """Chosen by a click, and given up by buttons that go away when they are pressed: manual control stays on."""
    await offboard.press("Go to a point")
    await offboard.press("Cancel")
    await expect(offboard.panel).to_be_focused()
    await offboard.press("Go to a point")
    box = await offboard.box(".map-canvas")
    await offboard.page.mouse.click(box["x"] + box["width"] / 2 + 20, box["y"] + box["height"] / 2 - 20)
    await offboard.until_text("go to a point")
    await offboard.panel.get_by_role("button", name="Stop").click(timeout=PRESS_MS)
    await expect(offboard.panel).to_be_focused()
    await offboard.until_text("zero velocity")


async def test_sticks_a_gamepad_and_a_place_on_the_map_fly_it_and_the_mission_goes_on(
    fleet_and_panel: tuple[SimulatedFleet, OffboardPanel, Dispatcher],
) -> None:
    _, offboard, dispatcher = fleet_and_panel
    await offboard.fly(keys_only_with_the_focus)
    await offboard.fly(stick_and_gamepad)
    await offboard.fly(place_on_the_map)
    await offboard.page.evaluate(AXE.read_text())
    await offboard.fly(nothing)
    assert await offboard.page.evaluate(AXE_ON_PANEL) == []  # it takes so long that the dead-man may act meanwhile
    run_id = (await dispatcher.get("/vehicles/v1"))["run_id"]
    back = "Resume the mission of v1"
    await offboard.fly_until_lost(nothing, lambda: offboard.press(back, hold_ms=HOLD_MS), "You exited to the mission")
    await dispatcher.until_run(run_id, lambda run: run["state"] in ("flying", "at_drop"), "it must go on", 20)
