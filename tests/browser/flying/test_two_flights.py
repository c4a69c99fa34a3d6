"""Two flights that are started by one button and watched beside each other; and the next thing to do in each state."""

from __future__ import annotations

from playwright.async_api import FloatRect, expect

from tests.support.accessibility import violations
from tests.support.dashboard import FLIGHT_MS, HOLD_MS, Dashboard, waiting_run

VEHICLES = 2

LEAVE_WHILE_HELD = """async (button, heldMs) => {
  const { left, right, bottom } = button.getBoundingClientRect();
  const press = (kind, clientY) => button.dispatchEvent(
    new PointerEvent(kind, { bubbles: true, isPrimary: true, pointerId: 1, clientX: (left + right) / 2, clientY }));
  press('pointerdown', bottom - 3);
  press('pointermove', bottom + 3);
  await new Promise(later => setTimeout(later, heldMs));
  press('pointerup', bottom + 3);
}"""
"""A pointer that leaves the button long before the press would be confirmed, however slow the machine is."""
PUSH_DOWN = "() => { document.querySelector('.run-panel').style.paddingTop = '200px' }"
"""As a run that ends moves what is below it: the pointer is not over its button any more."""


async def place_of(board: Dashboard, name: str) -> FloatRect:
    """Where a button is. Asked before it is held: a slow machine might confirm it first, and then it is gone."""
    await board.button(name).scroll_into_view_if_needed()
    box = await board.button(name).bounding_box()
    assert box is not None
    return box


async def hold_by_key(board: Dashboard, name: str) -> None:
    """Hold Enter on a button while the pointer happens to move over it."""
    box = await place_of(board, name)
    await board.button(name).focus()
    await board.page.keyboard.down("Enter")
    await board.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    await board.page.wait_for_timeout(HOLD_MS)
    await board.page.keyboard.up("Enter")


async def test_two_flights_start_together_and_are_both_in_view(flying_page: Dashboard) -> None:
    board, page = flying_page, flying_page.page
    await board.upload(waiting_run(), "v1")
    await board.until_next("Start v1")
    await board.upload(waiting_run("Second run"), "v2")
    await board.until_next("Start 2 flights: v1, v2")
    runs = page.get_by_role("region", name="Open runs")
    await runs.get_by_label("Include v1 in the start").uncheck()
    await board.until_next("Start 1 flight: v2")
    await page.get_by_role("tab", name="Plan").click()
    await page.get_by_role("tab", name="Run").click()
    await board.until_next("Start 1 flight: v2")
    await runs.get_by_label("Include v1 in the start").check()
    assert await violations(page, "two runs that are ready") == []
    await board.hold("Start 2 flights: v1, v2")
    for vehicle, name in (("v1", "Clinic run"), ("v2", "Second run")):
        row = runs.locator("li", has_text=vehicle)
        await expect(row).to_contain_text(name)
        await expect(row).to_contain_text("Flying", timeout=FLIGHT_MS)
    await board.until_next("Pause v2")
    await runs.get_by_role("button", name="v1").click()
    await board.until_next("Pause v1")
    await hold_by_key(board, "Pause v1")
    await board.until_next("Resume v1")
    commands: list[str] = []
    page.on("request", lambda request: commands.append(request.url.rpartition("/")[2]))
    await board.button("Land v1").evaluate(LEAVE_WHILE_HELD, HOLD_MS)
    assert commands.count("land") == 0, "the press left the button"
    await board.hold_while("Land v1", lambda: page.evaluate(PUSH_DOWN))
    await board.until_state("landed", "completed", "aborted")
    assert commands.count("land") == 1, "the press that stayed was meant"
    await board.until_next("Save delivery report")
