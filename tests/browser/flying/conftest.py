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


@pytest.fixture(scope="module")
def flying_service(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[ServiceProcess]:
    """A service whose VEHICLES fly several times as fast as real ones.

    A module has one for each flight, so that no test meets what another left; those that wait for theirs cost much.
    """
    folder = tmp_path_factory.mktemp("flying")
    with (
        SimulatedFleet(",".join(["quad"] * request.module.VEHICLES), speed=SPEED) as fleet,
        simulated_service(folder, fleet) as service,
    ):
        yield service


@pytest_asyncio.fixture(loop_scope="session")
async def flying_page(
    request: pytest.FixtureRequest, browser: Browser, flying_service: ServiceProcess
) -> AsyncIterator[Dashboard]:
    """The page on the flying service, live and with its fleet. The test fails as with `idle_page`."""
    async with Dashboard.opened(browser, flying_service.url, vehicles=request.module.VEHICLES) as dashboard:
        yield dashboard
