"""The map's own tools: distance and bearing, places that are found, zones of files; and signs that stand apart."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest
from playwright.async_api import Browser, expect

from tests.support.accessibility import violations
from tests.support.dashboard import Dashboard
from tests.support.picture import share_of_colour
from tests.support.service_process import ServiceProcess, until

APART_M, ICON_PX = 15.0, 36.0
"""Simulated vehicles stand so far apart, and are drawn so large."""
PATIENCE_S = 30.0
ZONE = "rgb(255, 206, 92)"
"""The outline of a zone in the dark theme."""
DROP_ON_MAP = """([name, text]) => {
  const transfer = new DataTransfer();
  transfer.items.add(new File([text], name));
  document.querySelector('.map-canvas').dispatchEvent(
    new DragEvent('drop', { bubbles: true, cancelable: true, dataTransfer: transfer }));
}"""

TOUCH = """canvas => {
  const { x, y } = canvas.getBoundingClientRect();
  const touch = new Touch({ identifier: 1, target: canvas, clientX: x + 200, clientY: y + 200 });
  const init = { bubbles: true, cancelable: true };
  const touches = { touches: [touch], targetTouches: [touch], changedTouches: [touch] };
  canvas.dispatchEvent(new TouchEvent('touchstart', { ...init, ...touches }));
  canvas.dispatchEvent(new TouchEvent('touchend', { ...init, changedTouches: [touch] }));
}"""


def zone(name: str) -> dict[str, Any]:
    """Around the vehicles."""
    ring = [[8.544, 47.397], [8.547, 47.397], [8.547, 47.399], [8.544, 47.397]]
    geometry = {"type": "Polygon", "coordinates": [ring]}
    return {"type": "Feature", "properties": {"name": name}, "geometry": geometry}


@pytest.mark.parametrize("width", [1440, 360])
async def test_the_signs_of_simulated_vehicles_stand_apart_at_the_first_zoom(
    browser: Browser, idle_service: ServiceProcess, width: int
) -> None:
    async with Dashboard.opened(browser, idle_service.url, width=width, height=800) as board:
        scale = board.page.locator(".map-scale")

        async def apart_px() -> float:
            """As the scale says, which is a line of round length."""
            length_m, width_px = await scale.evaluate("it => [parseFloat(it.textContent), it.offsetWidth]")
            return float(APART_M / length_m * width_px)

        await expect(scale).to_have_text(re.compile(r"^\d+ m$"))
        await until(apart_px, lambda px: px >= ICON_PX, "the fleet must come into view", PATIENCE_S)


async def test_two_clicks_give_distance_and_bearing_in_the_chosen_units(idle_page: Dashboard) -> None:
    page, hint = idle_page.page, idle_page.page.locator(".map-hint")
    await expect(page.locator(".map-scale")).to_have_text(re.compile("^20 m$"))
    await page.locator("body").press("m")
    await expect(hint).to_contain_text("measure from")
    box = await page.locator(".map-canvas").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    await page.mouse.click(x, y - 150)
    await expect(hint).to_contain_text("measure to")
    await page.mouse.click(x, y - 50)
    await expect(hint).to_contain_text(re.compile(r"\d+ m, 180°"))
    await page.get_by_label("Units").select_option("ft, kn")
    await expect(hint).to_contain_text(re.compile(r"\d+ ft, 180°"))
    assert await violations(page, "a measured distance") == []
    await page.keyboard.press("Escape")
    await expect(hint).to_have_count(0)


async def test_coordinates_and_plus_codes_are_found_and_other_words_are_told(idle_page: Dashboard) -> None:
    page, field = idle_page.page, idle_page.page.get_by_label("Coordinates or plus code")
    await idle_page.button("Not now").click()
    await page.locator("body").press("/")
    await field.fill("the clinic")
    await field.press("Enter")
    await expect(page.get_by_role("search").get_by_role("alert")).to_contain_text("plus code")
    assert await violations(page, "a place that is not found") == []
    for text, country in (("40°25'00\"N 3°42'13\"W", "Spain"), ("8FVC9GXW+36", "Switzerland")):
        await field.fill(text)
        await field.press("Enter")
        await expect(page.get_by_text(f"{country} · Coarse world map")).to_be_visible()
    await field.press("Escape")
    await expect(field).to_have_count(0)


async def test_follow_brings_a_vehicle_into_view_until_the_map_is_moved_or_touched(idle_page: Dashboard) -> None:
    page, field = idle_page.page, idle_page.page.get_by_label("Coordinates or plus code")
    await idle_page.button("Not now").click()
    await idle_page.vehicle("v1").click()
    await page.locator("body").press("/")
    await field.fill("40.4168, -3.7038")
    await field.press("Enter")
    await expect(page.get_by_text("Spain · Coarse world map")).to_be_visible()
    await field.press("Escape")
    follow = idle_page.button("Follow v1")
    await follow.click()
    await expect(page.get_by_text("Switzerland · Coarse world map")).to_be_visible()
    await expect(follow).to_have_attribute("aria-pressed", "true")
    box = await page.locator(".map-canvas").bounding_box()
    assert box is not None
    await page.mouse.move(box["x"] + 200, box["y"] + 200)
    await page.mouse.down()
    await page.mouse.move(box["x"] + 260, box["y"] + 220, steps=3)
    await page.mouse.up()
    await expect(follow).to_have_attribute("aria-pressed", "false")
    await follow.click()
    await expect(follow).to_have_attribute("aria-pressed", "true")
    await page.locator(".map-canvas canvas").evaluate(TOUCH)
    await expect(follow).to_have_attribute("aria-pressed", "false")


async def test_zones_of_a_file_are_drawn_and_kept_until_they_are_removed(
    browser: Browser, idle_service: ServiceProcess
) -> None:
    async with Dashboard.opened(browser, idle_service.url, fine_map=True) as board:
        await zones_are_drawn_and_kept(board)


async def zones_are_drawn_and_kept(board: Dashboard) -> None:
    """Their outlines are thin."""
    page, panel = board.page, board.page.get_by_role("region", name="Zones")
    canvas = page.locator(".map-canvas canvas")
    assert await share_of_colour(canvas, ZONE) == 0
    await page.evaluate(DROP_ON_MAP, ["airport.geojson", json.dumps(zone("CTR"))])
    await expect(panel).to_contain_text("airport")
    await until(lambda: share_of_colour(canvas, ZONE), lambda share: share > 0, "the zone must be drawn", PATIENCE_S)
    await page.evaluate(DROP_ON_MAP, ["metres.geojson", json.dumps({"type": "Point", "coordinates": [2_683_000, 1]})])
    await expect(panel.get_by_role("alert")).to_contain_text("metres.geojson: Feature 1 has a position that is not")
    assert await violations(page, "zones") == []
    await page.reload()
    await board.until_live()
    await board.button("Zones").click()
    async with page.expect_file_chooser() as chooser:
        await board.button("Open GeoJSON file").click()
    file = {"name": "heliport.json", "mimeType": "application/json", "buffer": json.dumps(zone("H")).encode()}
    await (await chooser.value).set_files(file)  # type: ignore[arg-type]
    await expect(panel.get_by_role("listitem")).to_have_text(["airport", "heliport"])
    for name in ("airport", "heliport"):
        await board.button(f"Remove {name}").click()
    await expect(panel).to_contain_text("stays in this browser")
