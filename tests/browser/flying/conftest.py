"""Vehicles that fly under the page, for as long as these tests take: at several times real time they cost much."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator

import pytest
import pytest_asyncio
from playwright.async_api import Browser

from tests.browser.conftest import SPEED, simulated_service
from tests.support.dashboard import Dashboard
from tests.support.service_process import ServiceProcess
from tests.support.simulated import SimulatedFleet

VEHICLES = 7
"""One for each flight: no test meets what another left."""


@pytest.fixture(scope="package")
def flying_service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServiceProcess]:
    """A service whose vehicles fly, each for one test, several times as fast as real ones."""
    folder = tmp_path_factory.mktemp("flying")
    with (
        SimulatedFleet(",".join(["quad"] * VEHICLES), speed=SPEED) as fleet,
        simulated_service(folder, fleet) as service,
    ):
        yield service


@pytest_asyncio.fixture(loop_scope="session")
async def flying_page(browser: Browser, flying_service: ServiceProcess) -> AsyncIterator[Dashboard]:
    """The page on the flying service, live and with its fleet. The test fails as with `idle_page`."""
    async with Dashboard.opened(browser, flying_service.url, vehicles=VEHICLES) as dashboard:
        yield dashboard
