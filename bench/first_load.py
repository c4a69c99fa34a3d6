"""How long it takes until the page can be used, with nothing of it in the browser's cache.

Usage: python -m bench.first_load [--loads 5] [--page FOLDER]

Usable is: the fleet is in the list, live, and its rows have been painted. Drawn is: the map has drawn it too. The
floor is a page of one line from the same server in the same browser; with it the time of the machine, its load
and of starting a document is known. The promise is two seconds, and 1 MB apart from the map library, which
tests/browser/test_size.py checks.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import statistics
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from playwright.async_api import Browser, async_playwright, expect

from bench.page_load import DIST, served
from tests.browser.conftest import CHROMIUM, chromium_args

PROMISE_S: Final = 2.0
FLEETS: Final = (4, 200)
WATCH: Final = """
const { clearRect } = CanvasRenderingContext2D.prototype;
CanvasRenderingContext2D.prototype.clearRect = function (...box) {
  if (this.canvas.className === 'map-vehicles' && window.usable) window.drawn ??= performance.now();
  clearRect.apply(this, box);
};
const look = () => {
  const shows = document.querySelector('.connection.live') && document.querySelectorAll('.vehicle').length === COUNT;
  if (shows) requestAnimationFrame(() => { window.usable = performance.now(); });  // the frame after it is painted
  else requestAnimationFrame(look);
};
requestAnimationFrame(look);
"""
SAID: Final = """() => [
  usable, drawn, performance.getEntriesByType('resource').reduce((sum, one) => sum + one.transferSize, 0)]"""


async def load_s(browser: Browser, url: str, vehicles: int) -> tuple[float, float, int]:
    """Seconds until it is usable and until it is drawn, and bytes on the wire."""
    context = await browser.new_context(viewport={"width": 1440, "height": 900})
    page = await context.new_page()
    await page.add_init_script(WATCH.replace("COUNT", str(vehicles)))
    await page.goto(url)
    await page.wait_for_function("() => window.usable && window.drawn", timeout=60_000)
    usable_ms, drawn_ms, size = await page.evaluate(SAID)
    await expect(page.locator(".vehicle")).to_have_count(vehicles)
    await context.close()
    return usable_ms / 1000, drawn_ms / 1000, int(size)


async def floor_s(browser: Browser, url: str) -> float:
    """Seconds until a page of one line is painted."""
    context = await browser.new_context()
    page = await context.new_page()
    await page.goto(f"{url}/favicon.svg")
    shown_ms: float = await page.evaluate(
        "() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now()))))"
    )
    await context.close()
    return shown_ms / 1000


async def bench(dist: Path, loads: int) -> bool:
    """Print a line for each fleet; False if the promise is not kept."""
    kept = True
    out = sys.stdout.write
    out(f"load of the machine {os.getloadavg()[0]:.1f}\n")
    out("vehicles   usable: median   worst   of the floor   map drawn   on the wire\n")
    for vehicles in FLEETS:
        with tempfile.TemporaryDirectory() as folder:
            async with served(Path(folder), dist, vehicles, 10.0) as service, async_playwright() as playwright:
                browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=chromium_args())
                await load_s(browser, service.url, vehicles)  # the browser itself starts with it
                floors = [await floor_s(browser, service.url) for _ in range(loads)]
                found = [await load_s(browser, service.url, vehicles) for _ in range(loads)]
                await browser.close()
        usable_s = _column(found, 0)
        out(
            f"{vehicles:8} {statistics.median(usable_s):14.2f} s {max(usable_s):5.2f} s "
            f"{statistics.median(usable_s) / statistics.median(floors):11.0f} x "
            f"{statistics.median(_column(found, 1)):9.2f} s {found[0][2] / 1000:10.0f} kB\n"
        )
        kept = kept and statistics.median(usable_s) < PROMISE_S
    return kept


def _column(found: Sequence[tuple[float, float, int]], index: int) -> list[float]:
    return [float(one[index]) for one in found]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--loads", type=int, default=5)
    parser.add_argument("--page", type=Path, default=DIST, help="folder of the built page")
    arguments = parser.parse_args()
    if not (arguments.page / "index.html").exists():
        sys.exit("the page is not built: make")
    if not asyncio.run(bench(arguments.page, arguments.loads)):
        sys.exit(f"it takes longer than {PROMISE_S:g} s")


if __name__ == "__main__":
    main()
