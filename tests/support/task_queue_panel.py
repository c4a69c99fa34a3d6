"""The task queue as a pilot uses it on the page: by clicks on its map, and by the buttons of its list."""

from __future__ import annotations

from typing import Any

from playwright.async_api import Locator, expect

from tests.support.dashboard import HOLD_MS
from tests.support.offboard_panel import PRESS_MS, OffboardPanel
from tests.support.service_process import Dispatcher, until

CIRCLE = "Circle, radius 30 m, counter-clockwise"
PATH = "Path with 2 points"
RELEASE = "Go to and release"
CLICK = """async button => {
  button.dispatchEvent(new MouseEvent('click', { bubbles: true }));
  await new Promise(drawn => setTimeout(drawn));
  return button.getAttribute('aria-label');
}"""
"""As assistive technology clicks. Returns what the button is called then: after a few seconds it forgets the click."""


class TaskBoard:
    """The tasks of v1."""

    def __init__(self, offboard: OffboardPanel, dispatcher: Dispatcher) -> None:
        self.offboard = offboard
        self.panel = offboard.panel
        self.dispatcher = dispatcher

    def state(self, name: str) -> Locator:
        """The section, while the queue is in this state."""
        return self.panel.locator(f'.tasks[data-state="{name}"]')

    def own(self, name: str) -> Locator:
        """A button of the panel by its whole name."""
        return self.panel.get_by_role("button", name=name, exact=True)

    async def press(self, name: str) -> None:
        """Press it."""
        await self.own(name).click(timeout=PRESS_MS)

    async def place(self, *offsets: tuple[int, int]) -> None:
        """Click on the map, so many pixels right of its middle and below it."""
        box = await self.offboard.box(".map-canvas")
        for right, down in offsets:
            await self.offboard.page.mouse.click(
                box["x"] + box["width"] / 2 + right, box["y"] + box["height"] / 2 + down
            )

    async def lists(self, *titles: str) -> None:
        """Wait until the list has these tasks in this order, and so has the service."""
        await expect(self.panel.locator(".task b")).to_have_text(list(titles))
        kinds = {CIRCLE: "circle", PATH: "path", RELEASE: "goto"}
        queue = await self.dispatcher.get("/vehicles/v1/tasks")
        assert [entry["task"]["type"] for entry in queue["tasks"]] == [kinds[title] for title in titles]

    async def queue_by_clicks(self) -> None:
        """A circle, a path whose second place is taken back, and a release, which is held to confirm."""
        await self.press("Circle")
        await self.panel.get_by_label("Radius").fill("30")
        await self.panel.get_by_label("Direction").select_option("counter")
        await self.place((40, 30))
        await self.press("Add to the queue")
        await self.press("Path")
        await self.place((30, 10), (60, 10))
        await self.press("Undo")
        await self.place((30, 40))
        await self.press("Add to the queue")
        await self.press("Go to")
        await self.panel.get_by_label("On arrival").select_option("release")
        await self.place((20, 40))
        release = self.panel.get_by_role("button", name="Queue a release by v1")
        await expect(release).to_be_enabled()
        assert await release.evaluate(CLICK) == "Press again: Queue a release by v1"
        await self.press("Undo")  # nothing is left to release: the first press is forgotten
        await expect(release).to_be_disabled()
        await self.place((20, 40))
        await expect(release).to_be_enabled()
        label = await release.get_attribute("aria-label")  # of now: after a while it forgets by itself
        assert label == "Queue a release by v1, hold to confirm"
        await release.click(delay=HOLD_MS, timeout=PRESS_MS)
        await self.lists(CIRCLE, PATH, RELEASE)

    async def reorder(self) -> None:
        """By the buttons, which keep the focus, and by dragging."""
        await self.press("Move task 3 up")
        await self.lists(CIRCLE, RELEASE, PATH)
        await expect(self.own("Move task 2 up")).to_be_focused()
        await self.panel.locator(".task").nth(0).scroll_into_view_if_needed()  # a drag that scrolls carries another one
        await self.panel.locator(".task").nth(2).drag_to(self.panel.locator(".task").nth(0), timeout=PRESS_MS)
        await self.lists(PATH, CIRCLE, RELEASE)
        await self.press("Move task 1 down")  # the circle has no end: it is flown until somebody ends it
        await self.lists(CIRCLE, PATH, RELEASE)

    async def edit(self) -> None:
        """Another duration by the keyboard, in the task's place in the list; the current task is not edited."""
        await expect(self.own("Edit task 1")).to_have_count(0)
        await self.own("Edit task 2").press("Enter")
        await expect(self.panel.locator(".task-edit").get_by_label("Duration")).to_be_focused()
        await self.offboard.page.keyboard.type("45")
        await self.offboard.page.keyboard.press("Enter")
        await expect(self.own("Edit task 2")).to_be_focused()
        await expect(self.panel.locator(".task").nth(1)).to_contain_text("for 45 s")
        queue = await self.dispatcher.get("/vehicles/v1/tasks")
        assert [entry["task"]["duration_s"] for entry in queue["tasks"]] == [-1.0, 45.0, -1.0]

    async def refused(self, code: str) -> None:
        """Too high: said beside the form, and what was put together stays."""
        await self.press("Line")
        await self.place((30, 30), (40, 40))
        height = self.panel.get_by_label("Height above home")
        await height.press_sequentially("9e")
        await expect(height).to_have_attribute("aria-invalid", "true")
        await expect(self.own("Add to the queue")).to_have_attribute("aria-disabled", "true")
        await height.fill("900")
        await self.press("Add to the queue")
        refusal = self.panel.locator(".tasks").get_by_role("alert")
        await expect(refusal).to_contain_text("900 m above home is more than")
        await expect(refusal.locator("code")).to_have_text(code)
        await expect(self.own("Line")).to_have_attribute("aria-pressed", "true")
        await self.press("Cancel")

    async def of_another_client(self, task: dict[str, Any]) -> None:
        """Somebody else's queue is seen, and cannot be touched."""
        offboard, tasks = "/vehicles/v1/offboard", "/vehicles/v1/tasks"
        lease = {"lease": (await self.dispatcher.post(f"{offboard}/lease"))["lease"]}

        async def seen() -> int:
            await self.dispatcher.post(f"{offboard}/lease/renew", lease)
            return await self.panel.locator(".task").count()

        try:
            await self.dispatcher.post(tasks, {**lease, "task": task})
            await until(seen, lambda count: count == 1, "it must be shown", 30)
            await expect(self.panel.get_by_role("button", name="task")).to_have_count(0)
        finally:  # else whoever tries again finds it taken
            await self.dispatcher.post(f"{offboard}/lease/release", lease)
        await expect(self.panel.locator(".task")).to_have_count(0)
