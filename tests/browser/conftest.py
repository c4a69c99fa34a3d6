"""One headless Chromium for all browser tests, in which WebGL really runs."""

from __future__ import annotations

import os
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from playwright.async_api import Browser, async_playwright

CHROMIUM = Path(os.environ.get("WAYDROP_CHROMIUM", "/usr/bin/chromium"))

CHROMIUM_ARGS = (
    "--use-angle=swiftshader",  # WebGL 2 in software: MapLibre draws on machines without a graphics card
    "--enable-unsafe-swiftshader",
    "--no-first-run",
    "--disable-background-networking",  # the only requests a test may see are the page's own
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
)


def chromium_args() -> list[str]:
    """The flags above; as root (containers) Chromium starts only without its sandbox."""
    return [*CHROMIUM_ARGS, *(["--no-sandbox"] if os.geteuid() == 0 else [])]


@pytest.fixture
async def browser() -> AsyncIterator[Browser]:
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=chromium_args())
        yield browser
        await browser.close()
