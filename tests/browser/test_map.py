"""The map under the grid: a world that ships with the page, a file's vector tiles, and a style that somebody chose."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest_asyncio
from playwright.async_api import Browser, Route, expect

from tests.browser.conftest import simulated_service
from tests.support.accessibility import violations
from tests.support.dashboard import Dashboard
from tests.support.fake_links import HOME
from tests.support.map_files import MapServer, map_server, write_vector_map
from tests.support.picture import share_of_colour
from tests.support.service_process import ServiceProcess, until
from tests.support.simulated import SimulatedFleet

WATER, LAND = "rgb(10, 25, 41)", "rgb(19, 27, 36)"
"""Of the coarse world in the dark theme."""
PROTOMAPS_WATER, PROTOMAPS_LAND = "rgb(128, 222, 234)", "rgb(226, 223, 218)"
"""Of Protomaps' light style."""
PINK = "rgb(255, 0, 170)"
PATIENCE_S = 30.0


async def zoomed_out(board: Dashboard) -> None:
    """The whole world. Clicks that a busy page takes together zoom out once: the scale tells how far it is."""
    scale, button = board.page.locator(".map-scale"), board.button("Zoom out")
    await expect(scale).to_be_visible()

    async def scales() -> int:
        await button.click()
        return await scale.count()

    await until(scales, lambda count: count == 0, "more than half of the world must come into view", PATIENCE_S)


async def until_shown(board: Dashboard, colour: str, least: float) -> None:
    """Wait until so much of the map has this colour."""
    canvas = board.page.locator(".map-canvas canvas")
    await until(
        lambda: share_of_colour(canvas, colour), lambda share: share > least, f"{colour} must be drawn", PATIENCE_S
    )


@pytest_asyncio.fixture(loop_scope="session")
async def maps() -> AsyncIterator[MapServer]:
    """A server of another origin."""
    async with map_server() as server:
        yield server


async def test_the_world_ships_with_the_page_and_nothing_outside_is_asked(
    browser: Browser, idle_service: ServiceProcess
) -> None:
    """`problems` holds a request to any other host against the page, and each console error."""

    async def refuse(route: Route) -> None:
        own = route.request.url.startswith(idle_service.url)
        await (route.continue_() if own else route.abort())

    async with Dashboard.opened(browser, idle_service.url) as board:
        await board.page.route("**", refuse)
        await board.page.reload()
        await board.until_live()
        offer = board.page.get_by_role("region", name="Street map")
        await expect(offer).to_contain_text("tiles.openfreemap.org")
        assert await violations(board.page, "the offer of a map") == []
        await offer.get_by_role("button", name="Not now").click()
        await expect(board.page.get_by_text("Switzerland · Coarse world map")).to_be_visible()
        await zoomed_out(board)
        await until_shown(board, WATER, 0.2)
        await until_shown(board, LAND, 0.1)
        await board.page.reload()
        await expect(board.page.get_by_text("Coarse world map")).to_be_visible()
        await expect(offer).to_have_count(0)
        await board.page.unroute_all(behavior="ignoreErrors")  # a request may be on its way as the page is closed


async def test_vector_tiles_of_a_file_are_drawn_by_the_service_alone(browser: Browser, tmp_path: Path) -> None:
    file = write_vector_map(tmp_path / "zurich.pmtiles", HOME.latitude_deg, HOME.longitude_deg)
    with SimulatedFleet("quad") as fleet, simulated_service(tmp_path, fleet, WAYDROP_TILE_FILE=str(file)) as service:
        async with Dashboard.opened(browser, service.url, vehicles=1, scheme="light") as board:
            await until_shown(board, PROTOMAPS_WATER, 0.2)
            await until_shown(board, PROTOMAPS_LAND, 0.2)
            await expect(board.page.get_by_text("© OpenStreetMap")).to_be_visible()
            await expect(board.page.get_by_role("region", name="Street map")).to_have_count(0)
            await board.button("Map").and_(board.page.locator("[aria-pressed=true]")).click()
            await until_shown(board, "rgb(244, 245, 242)", 0.5)


async def test_a_chosen_street_map_stays_until_one_click_turns_it_off(
    browser: Browser, tmp_path: Path, maps: MapServer
) -> None:
    with (
        SimulatedFleet("quad") as fleet,
        simulated_service(tmp_path, fleet, WAYDROP_BASEMAP_STYLE=f"{maps.url}/style.json") as service,
    ):
        async with Dashboard.opened(browser, service.url, vehicles=1) as board:
            assert (maps.asked, board.problems) == ([], [])
            await board.button("Show street map").click()
            await until_shown(board, PINK, 0.5)
            await expect(board.page.get_by_text("© Map makers")).to_be_visible()
            await board.page.reload()
            await until_shown(board, PINK, 0.5)
            await board.button("Street map from").click()
            await until_shown(board, LAND, 0.5)
            await board.page.reload()
            await board.until_live()
            assert maps.asked == ["/style.json"] * 2
            asked = [f"request to another host: {maps.url}/style.json"] * 2
            assert board.problems == asked  # no glyph server, nothing that the policy refused
            board.problems.clear()


async def test_a_street_map_that_does_not_come_is_told_in_words(browser: Browser, idle_service: ServiceProcess) -> None:
    async with Dashboard.opened(browser, idle_service.url) as board:
        await board.page.route("https://**", lambda route: route.abort())
        await board.button("Show street map").click()
        await expect(board.page.get_by_text("could not be loaded")).to_contain_text("tiles.openfreemap.org")
        assert board.problems  # the request that was chosen, and what Chromium itself writes of it
        board.problems.clear()
