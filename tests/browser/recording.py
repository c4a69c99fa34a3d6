"""`python -m tests.browser.recording FILE.webp`: a delivery on the page, from the stored plan to the released parcel.

Not a test: the recording that the README shows. Its time runs as on the page, where the vehicles fly at several times
real time.
"""

from __future__ import annotations

import asyncio
import io
import json
import sys
import tempfile
import time
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from PIL import Image
from playwright.async_api import Page, async_playwright, expect

from tests.browser.conftest import CHROMIUM, FLEET, SPEED, chromium_args, simulated_service
from tests.support.dashboard import CLINIC_RUN, FLIGHT_MS, Dashboard
from tests.support.simulated import SimulatedFleet

SIZE = (1280, 800)
SHOWN_SIZE = (960, 600)
FRAME_S = 0.5
LAST_FRAME_S = 4.0
LOOK_S = 1.5
"""As long as a reader needs to see what a click did."""
QUALITY = 75
MOST_BYTES = 2_000_000


@dataclass
class Recorder:
    """Pictures of a page, each with the time at which it was taken."""

    page: Page
    frames: list[tuple[float, Image.Image]] = field(default_factory=list)

    async def run(self) -> None:
        """Take pictures until cancelled."""
        while True:
            due = time.monotonic() + FRAME_S
            picture = Image.open(io.BytesIO(await self.page.screenshot()))
            self.frames.append((time.monotonic(), picture.convert("RGB").resize(SHOWN_SIZE, Image.Resampling.LANCZOS)))
            await asyncio.sleep(max(0.0, due - time.monotonic()))

    def save(self, file: Path) -> None:
        """Each picture stays until the next one was taken. Fails if the file is larger than a README can carry."""
        times = [taken for taken, _ in self.frames]
        durations_s = [after - before for before, after in pairwise(times)] + [LAST_FRAME_S]
        first, *others = [picture for _, picture in self.frames]
        first.save(
            file,
            save_all=True,
            append_images=others,
            duration=[round(1000 * duration_s) for duration_s in durations_s],
            loop=0,
            quality=QUALITY,
            method=6,
            minimize_size=True,
        )
        size = file.stat().st_size
        assert size < MOST_BYTES, f"{file} has {size} bytes"


async def deliver(board: Dashboard) -> None:
    """Open the stored plan, upload it, start the flight, and look on until the vehicle is back."""
    page = board.page
    await asyncio.sleep(LOOK_S)
    await page.get_by_role("tab", name="Plan").click()
    await board.button("Plan library").click()
    await asyncio.sleep(LOOK_S)
    await page.get_by_role("region", name="Plan library").get_by_role("button", name="Clinic run").first.click()
    await page.locator(".send").get_by_label("Vehicle").select_option("v1")
    await expect(page.get_by_text("Can be flown")).to_be_visible()
    await asyncio.sleep(2 * LOOK_S)
    await board.button("Upload to v1").click()
    await board.until_state("uploaded")
    await asyncio.sleep(LOOK_S)
    await board.hold("Start v1")
    await expect(page.locator(".drop-card .badge")).to_have_text("Released", timeout=FLIGHT_MS)
    await board.until_state("completed")


async def main(file: Path) -> None:
    with (
        tempfile.TemporaryDirectory() as data,
        SimulatedFleet(FLEET, speed=SPEED) as fleet,
        simulated_service(Path(data), fleet) as service,
    ):
        async with async_playwright() as playwright:
            browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=chromium_args())
            async with Dashboard.opened(browser, service.url, width=SIZE[0], height=SIZE[1], fine_map=True) as board:
                stored = await board.page.request.post(f"{service.url}/api/v1/plans", data=json.loads(CLINIC_RUN))
                assert stored.ok, await stored.text()
                await board.button("Not now").click()
                recorder = Recorder(board.page)
                recording = asyncio.create_task(recorder.run(), name="recording")
                await deliver(board)
                recording.cancel()
                await asyncio.gather(recording, return_exceptions=True)
            await browser.close()
    recorder.save(file)


if __name__ == "__main__":
    asyncio.run(main(Path(sys.argv[1])))
