"""One headless Chromium in which WebGL really runs, and the real service with simulated vehicles behind the page."""

from __future__ import annotations

import inspect
import os
import shutil
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
import pytest_asyncio
from playwright.async_api import Browser, async_playwright, expect

from tests.support.dashboard import Dashboard
from tests.support.forked_service import ForkedService
from tests.support.service_process import ServiceProcess
from tests.support.simulated import SimulatedFleet

CHROMIUM = Path(os.environ.get("WAYDROP_CHROMIUM") or shutil.which("chromium-headless-shell") or "/usr/bin/chromium")
"""The shell is the same engine without a window: the address bar's own pages cost as much as Waydrop's page."""

HERE = Path(__file__).parent

CHROMIUM_ARGS = (
    "--use-angle=swiftshader",  # WebGL 2 in software: MapLibre draws on machines without a graphics card
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",  # else the whole page is put together by the software GL: most of a core, all the time
    "--no-first-run",
    "--disable-background-networking",  # the only requests a test may see are the page's own
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
)

expect.set_options(timeout=20_000)  # it ends a hang; on a busy machine a check of a plan may take seconds

FLEET = "quad,quad,plane,vtol"
GAP_S = 2.5
"""More than the default: on a busy machine a healthy process may stand still for longer than that."""
SPEED = 4.0


def chromium_args() -> list[str]:
    """The flags above; as root (containers) Chromium starts only without its sandbox."""
    return [*CHROMIUM_ARGS, *(["--no-sandbox"] if os.geteuid() == 0 else [])]


def simulated_service(data_dir: Path, fleet: SimulatedFleet, **environment: str) -> ServiceProcess:
    """A service that knows these vehicles and the simulator behind them."""
    control = f"127.0.0.1:{fleet.control_port}"
    return ForkedService(data_dir, fleet.connections, WAYDROP_SIMULATOR_CONTROL=control, **environment)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """One event loop for all tests of this folder: a browser belongs to the loop that started it."""
    for item in items:
        is_async = isinstance(item, pytest.Function) and inspect.iscoroutinefunction(item.function)
        if item.path.is_relative_to(HERE) and is_async:
            item.add_marker(pytest.mark.asyncio(loop_scope="session"), append=False)


@pytest_asyncio.fixture(scope="package", loop_scope="session")
async def browser() -> AsyncIterator[Browser]:
    """One for this folder; each page has a context of its own, so that nothing is left for the next."""
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=chromium_args())
        yield browser
        await browser.close()


@pytest.fixture(scope="package")
def idle_service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServiceProcess]:
    """A service whose vehicles stay on the ground, for the tests that only look."""
    folder = tmp_path_factory.mktemp("idle")
    with (
        SimulatedFleet(FLEET) as fleet,
        simulated_service(folder, fleet, WAYDROP_OFFBOARD_GAP_S=str(GAP_S)) as service,
    ):
        yield service


@pytest_asyncio.fixture(loop_scope="session")
async def idle_page(browser: Browser, idle_service: ServiceProcess) -> AsyncIterator[Dashboard]:
    """The page on the idle service, live and with its fleet. The test fails on a console error or a foreign request."""
    async with Dashboard.opened(browser, idle_service.url) as dashboard:
        yield dashboard
