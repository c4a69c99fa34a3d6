"""The page on an API node, in Chromium: the vehicles of all sites, and a delivery from upload to release."""

from __future__ import annotations

import json

from playwright.async_api import async_playwright, expect

from tests.browser.conftest import CHROMIUM, chromium_args
from tests.support.cluster_process import SITES, Cluster
from tests.support.dashboard import CLINIC_RUN, Dashboard
from tests.support.patient_drops import patient

SOON_MS, FLIGHT_MS = 60_000, 300_000


async def test_the_page_of_an_api_node_flies_a_delivery_at_another_site(cluster: Cluster) -> None:
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=chromium_args())
        try:
            async with Dashboard.opened(browser, cluster.nodes[1].url, vehicles=len(SITES)) as dashboard:
                for site in SITES:
                    row = dashboard.page.locator(".vehicle", has_text=f"{site}-v1")
                    await expect(row).to_contain_text("Multicopter", timeout=SOON_MS)
                    await expect(row.locator(".link-age")).to_have_class("link-age ok", timeout=SOON_MS)
                await dashboard.upload(json.dumps(patient(json.loads(CLINIC_RUN))), "south-v1")
                await dashboard.hold("Start south-v1")
                over = dashboard.page.locator('.run-head[data-state="completed"]')
                await expect(over).to_be_visible(timeout=FLIGHT_MS)
                await expect(dashboard.page.get_by_text("Released").first).to_be_visible(timeout=SOON_MS)
        finally:
            await browser.close()
