"""A plan edited on the page: by mouse and keyboard, as JSON, and from files of its own and of other software."""

from __future__ import annotations

import json
from pathlib import Path

from playwright.async_api import expect

from tests.support.dashboard import CLINIC_RUN, Dashboard
from tests.support.editor import Editor
from tests.support.paths import ROOT

INTERCHANGE = ROOT / "tests" / "data" / "interchange"

DROP_FILE = """([name, text]) => {
  const transfer = new DataTransfer();
  transfer.items.add(new File([text], name, { type: 'application/json' }));
  const event = (type) => new DragEvent(type, { dataTransfer: transfer, bubbles: true, cancelable: true });
  document.querySelector('main').dispatchEvent(event('dragover'));
  document.querySelector('main').dispatchEvent(event('drop'));
}"""


async def test_points_are_dragged_and_fences_drawn_and_the_json_is_in_step_both_ways(idle_page: Dashboard) -> None:
    editor = Editor(idle_page)
    await editor.start_new()
    place = await editor.on_map(-80, 100)
    await editor.draw(-80, 100)
    before = (await editor.document())["items"][1]
    await editor.drag(place, await editor.on_map(60, 160))
    after = (await editor.document())["items"][1]
    assert after["longitude_deg"] > before["longitude_deg"]
    assert after["latitude_deg"] > before["latitude_deg"]

    await idle_page.button("Draw a keep-out").click()
    for east_px, north_px in ((-60, -60), (60, -60), (40, -160)):
        await editor.draw(east_px, north_px)
    await idle_page.page.keyboard.press("Enter")
    plan = await editor.document()
    assert [len(area["vertices"]) for area in plan["geofence"]["polygons"]] == [3]

    await idle_page.page.keyboard.press("Control+z")
    await idle_page.page.keyboard.press("Control+z")
    undone = await editor.document()
    assert undone["items"][1] == before
    assert "geofence" not in undone

    undone["items"][1]["relative_altitude_m"] = 33
    await idle_page.fill_plan(json.dumps(undone))
    await expect(editor.item("point")).to_contain_text("33 m above home")


async def test_a_plan_is_edited_by_keyboard_alone(idle_page: Dashboard) -> None:
    editor = Editor(idle_page)
    await editor.start_new()
    await idle_page.page.locator(".map-canvas canvas").focus()
    await idle_page.page.keyboard.press("Space")
    await expect(editor.items).to_have_count(3)
    await idle_page.page.keyboard.press("Escape")
    await idle_page.page.keyboard.press("Space")
    await expect(editor.items).to_have_count(3)
    altitude = idle_page.page.get_by_label("Relative altitude")
    await altitude.focus()
    await idle_page.page.keyboard.press("Control+a")
    await idle_page.page.keyboard.type("12.5")
    await expect(altitude).to_have_value("12.5")
    name = idle_page.page.get_by_label("Id", exact=True)
    await name.focus()
    await idle_page.page.keyboard.press("End")
    await idle_page.page.keyboard.type("-of-call")  # the item stays open while its name changes
    await expect(name).to_have_value("point-of-call")
    item = (await editor.document())["items"][1]
    assert (item["id"], item["relative_altitude_m"]) == ("point-of-call", 12.5)


async def test_a_file_dropped_on_the_page_is_opened_and_saved_as_it_is(idle_page: Dashboard, tmp_path: Path) -> None:
    await idle_page.page.evaluate(DROP_FILE, ["clinic-run.json", CLINIC_RUN])
    await expect(idle_page.page.get_by_role("heading", name="Clinic run")).to_be_visible()
    async with idle_page.page.expect_download() as download:
        await idle_page.button("Save file").click()
    saved = await download.value
    assert saved.suggested_filename == "clinic-run.json"
    await saved.save_as(tmp_path / "saved.json")
    assert (tmp_path / "saved.json").read_text() == CLINIC_RUN
    await files_of_other_software_are_read_and_written(idle_page, tmp_path)


async def files_of_other_software_are_read_and_written(board: Dashboard, folder: Path) -> None:
    """What a file loses on its way in or out is said; what is refused leaves the open plan as it is."""
    board.tolerated = ("status of 422",)  # Chromium writes each refused request into its console
    await board.page.evaluate(DROP_FILE, ["survey.plan", (INTERCHANGE / "survey.plan").read_text()])
    refused = board.page.locator(".conversion[role=alert]")
    await expect(refused).to_contain_text("survey.plan cannot be imported")
    await expect(refused.locator(".finding").first).to_contain_text("conversion.complex_item")
    await expect(board.page.get_by_role("heading", name="Clinic run")).to_be_visible()

    async with board.page.expect_file_chooser() as choosing:
        await board.button("Open file").click()
    await (await choosing.value).set_files(INTERCHANGE / "mission-planner.waypoints")
    read = board.page.locator(".conversion[role=status]")
    await expect(read).to_contain_text("Imported mission-planner.waypoints (waypoint file)")
    await expect(board.page.get_by_role("heading", name="mission-planner")).to_be_visible()
    await board.page.evaluate(DROP_FILE, ["losses.plan", (INTERCHANGE / "losses.plan").read_text()])
    await expect(read).to_contain_text("Imported losses.plan (QGroundControl .plan)")
    await expect(read.locator("summary", has_text="Not converted")).to_be_visible()

    await board.page.evaluate(DROP_FILE, ["clinic-run.json", CLINIC_RUN])
    await expect(board.page.locator(".conversion")).to_have_count(0)
    export = board.page.get_by_label("Export the stored plan")
    await expect(export).to_be_disabled()
    await board.page.get_by_role("button", name="Store", exact=True).click()
    async with board.page.expect_download() as download:
        await export.select_option("qgc")
    exported = await download.value
    assert exported.suggested_filename == "clinic-run.plan"
    await exported.save_as(folder / "exported.plan")
    assert json.loads((folder / "exported.plan").read_text())["fileType"] == "Plan"
    await expect(read).to_contain_text("Exported clinic-run.plan (QGroundControl .plan)")
