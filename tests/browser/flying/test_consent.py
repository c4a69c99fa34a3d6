"""A drop that asks: who looks elsewhere is called, a reload keeps the question, and a release is held to confirm."""

from __future__ import annotations

import json
import os
import re

from playwright.async_api import expect

from tests.support.accessibility import violations
from tests.support.dashboard import CLINIC_RUN, FLIGHT_MS, Dashboard

VEHICLES = 1


def asking_plan() -> str:
    """The clinic run with a drop that asks, and a hold in which a busy machine has two minutes to answer."""
    plan = json.loads(CLINIC_RUN)
    drop = next(item for item in plan["items"] if item["type"] == "gripper")
    drop |= {"consent": "operator", "hold_s": 600}
    return json.dumps(plan)


async def test_an_operator_is_called_to_a_drop_that_asks_and_releases_it_after_a_reload(flying_page: Dashboard) -> None:
    page = flying_page.page
    await flying_page.upload(asking_plan(), "v1")
    await flying_page.hold("Start v1")
    await page.get_by_role("tab", name="Plan", exact=True).click()
    await flying_page.button("Show the request of v1").click(timeout=FLIGHT_MS)

    card = page.get_by_role("region", name="v1 asks for consent to drop")
    await expect(card).to_contain_text("battery")
    await expect(card.get_by_role("timer")).to_have_text(re.compile(r"^\d+ s$"))
    await page.reload()
    await flying_page.until_live()
    await expect(card).to_be_visible()
    if folder := os.environ.get("WAYDROP_PICTURES"):
        await page.screenshot(path=f"{folder}/consent.png")
    assert await violations(page, "a question for consent") == []
    assert await flying_page.tap("Release drop from v1") == "Hold to release drop from v1"  # too short to be meant
    await expect(card).to_be_visible()
    await flying_page.hold("Release drop from v1")
    await expect(card).to_have_count(0)
    drop = page.get_by_role("article", name="Drop drop")
    await expect(drop.locator(".badge")).to_have_text("Released", timeout=FLIGHT_MS)
    await expect(drop).to_contain_text("Consent granted by local")
