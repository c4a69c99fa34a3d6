"""A plan drawn on the page: points, a parcel, a finding, its mending, then stored, listed and flown."""

from __future__ import annotations

from playwright.async_api import expect

from tests.support.dashboard import Dashboard
from tests.support.editor import Editor

VEHICLES = 1


async def test_a_plan_is_drawn_mended_stored_and_flown(flying_page: Dashboard) -> None:
    editor = Editor(flying_page)
    await editor.start_new()
    await editor.draw(-90, 120)
    await editor.draw(110, 130)
    await expect(editor.items).to_have_count(4)
    await flying_page.button("Drop a parcel here").click()
    await expect(editor.items).to_have_count(5)
    await expect(flying_page.page.get_by_text("Can be flown")).to_be_visible(timeout=20_000)

    for _ in range(2):
        await flying_page.button("Move drop up").click()
    finding = editor.item("drop").locator(".finding", has_text="gripper.must_follow_waypoint")
    await expect(finding.locator(".hint")).to_be_visible(timeout=20_000)
    await expect(flying_page.button("Upload to v1")).to_be_disabled()
    for _ in range(2):
        await flying_page.button("Undo").click()
    await expect(finding).to_have_count(0)

    await flying_page.page.get_by_role("tab", name="Details").click()
    await flying_page.page.get_by_label("Name").fill("Drawn by hand")
    await expect(flying_page.page.get_by_role("heading", name="Drawn by hand")).to_be_visible()
    await flying_page.page.get_by_role("button", name="Store", exact=True).click()
    await expect(flying_page.button("Stored")).to_be_visible()
    await flying_page.button("Plan library").click()
    await expect(flying_page.page.get_by_role("region", name="Plan library")).to_contain_text("Drawn by hand")
    await flying_page.button("Plan library").click()

    await flying_page.button("Upload to v1").click()
    await flying_page.until_state("uploaded")
    await flying_page.hold("Start v1")
    await flying_page.until_state("flying", "at_drop", "returning", "landed", "completed")
